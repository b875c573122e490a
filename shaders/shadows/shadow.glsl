// SPDX-License-Identifier: GPL-3.0-or-later
// Reads the shadow maps of a light: needs the samplers hair_front, hair_layers, surface_moments.

#include "shadows/opacity.glsl"

// Range around a strand, as a fraction of the map, in which surfaces behind it are looked up.
const float BEYOND_REACH = 0.01;

// The bias of a strand by the direction of its root: strands that grow away from the light are on the far side of a surface.
float strand_bias(vec3 root_direction, vec3 L)
{
  return SURFACE_BIAS * clamp(4.0 * dot(root_direction, L), -1.0, 1.0);
}

// Coordinates of a position in a light's maps, and its depth; false outside of the maps, which contain the hair and its
// surroundings.
bool shadow_place(Light light, vec3 position, out vec3 at, out float depth)
{
  at = vec3(0.0);
  depth = light_depth(light.kind, light.position.xyz, light.axis.xyz, light.near, light.extent, position);
  if (light.shadow_layer < 0) {
    return false;
  }
  vec4 clip = light.world_to_shadow * vec4(position, 1.0);
  at = vec3(0.5 * clip.xy / clip.w + 0.5, float(light.shadow_layer));
  return clip.w > 0.0 && at.xy == clamp(at.xy, vec2(0.0), vec2(1.0));
}

// Visibility of the light past surfaces: the upper bound of the fraction with a greater depth [Donnelly06].
float lit_part(vec3 at, float depth, float bias)
{
  vec2 moments = textureLod(surface_moments, at, 0.0).rg;
  // Depths are limited like those in the maps: otherwise surfaces would be in their own shadow.
  float warped = warped_depth(min(depth, FAR_SURFACE) - bias);
  float behind = warped - moments.x;
  float rounding = 0.3 * SURFACE_BIAS * WARP * warped;
  float variance = max(moments.y, rounding * rounding);
  // With a surface behind another, the bound is not tight: its tail is cut off.
  float part = clamp((variance / (variance + behind * behind) - 0.05) / 0.95, 0.0, 1.0);
  return (behind <= 0.0) ? 1.0 : part;
}

// Fade of the shadow of surfaces towards the border of a light's maps.
float inside_part(vec2 at)
{
  vec2 inside = min(at, vec2(1.0) - at);
  return smoothstep(0.0, 0.06, min(inside.x, inside.y));
}

// Visibility of the light past surfaces around the hair, from a map of these only.
float wide_lit_part(Light light, vec3 position)
{
  if (light.wide_layer < 0) {
    return 1.0;
  }
  float depth = light_depth(
      light.kind, light.position.xyz, light.axis.xyz, light.wide_near, light.wide_extent, position);
  vec4 clip = light.world_to_wide * vec4(position, 1.0);
  vec3 at = vec3(0.5 * clip.xy / clip.w + 0.5, float(light.wide_layer));
  return (clip.w > 0.0) ? mix(1.0, lit_part(at, depth, SURFACE_BIAS), inside_part(at.xy)) : 1.0;
}

// Count of a strand itself in a map at its axis, averaged over positions of the axis within a texel: interpolation weights
// the strand's coverage, which is a fraction of a texel's width or more than one.
float own_count(Light light, vec3 position, float radius)
{
  mat4 m = light.world_to_shadow;
  float across = length(vec3(m[0][0], m[1][0], m[2][0])) / dot(vec4(m[0][3], m[1][3], m[2][3], m[3][3]), vec4(position, 1.0));
  float covered = radius * across * float(textureSize(hair_layers, 0).x);
  float width = clamp(covered, 1.0, 2.0);
  return min(covered, 1.0) * (width - 0.25 * width * width);
}

// Mean number of strands that the light has crossed; behind: number of strands behind, up to the surface; own: count of the
// strand itself, to be left out.
float crossed_strands(vec3 at, float depth, float own, out float behind)
{
  vec2 ends = textureLod(hair_front, at, 0.0).rg;
  vec4 counts = textureLod(hair_layers, at, 0.0);
  float front = strands_in_front(counts, max(0.0, depth - ends.x), ends.y - ends.x, own);
  behind = max(0.0, counts[layer_of(ends.y - ends.x)] - own - front);
  // If surfaces occlude all strands there is no front depth.
  return mix(front, max(0.0, counts.w - own), smoothstep(1.0, 1.5, ends.x));
}

// The same for a point of a surface: strands that are occluded by surfaces are not in front of lit surfaces.
float crossed_before_surface(vec3 at, float depth)
{
  vec2 ends = textureLod(hair_front, at, 0.0).rg;
  vec4 counts = textureLod(hair_layers, at, 0.0);
  float front = strands_in_front(counts, max(0.0, depth - ends.x), ends.y - ends.x, 0.0);
  return front * (1.0 - smoothstep(1.0, 1.5, ends.x));
}

// Inverse of `surface_textures.packed_colors`.
vec3 unpacked_color(float packed_value)
{
  vec3 root = mod(floor(packed_value / vec3(65536.0, 256.0, 1.0)), 256.0) / 255.0;
  return root * root;
}

// Fraction of the places around a strand, seen from a light, with a surface behind the strand, and that surface's normal and
// color. L: towards the light; color: premultiplied by its fourth component, the fraction of places with a surface.
float surface_beyond(Light light, vec3 at, float depth, vec3 L, out vec3 normal, out vec4 color)
{
  color = vec4(0.0);
  ivec2 size = textureSize(surface_moments, 0).xy;
  vec2 slope = vec2(0.0);
  float found = 0.0;
  float total = 0.0;
  for (int corner = 0; corner < 4; corner++) {
    vec2 towards = 2.0 * vec2(float(corner & 1), float(corner >> 1)) - 1.0;
    vec3 place = at + vec3(BEYOND_REACH * towards, 0.0);
    float surface = textureLod(surface_moments, place, 0.0).b;
    ivec3 texel = ivec3(clamp(ivec2(place.xy * vec2(size)), ivec2(0), size - 1), int(place.z));
    float packed_value = texelFetch(surface_moments, texel, 0).a;
    // Negative without a surface.
    color += (packed_value >= 0.0) ? 0.25 * vec4(unpacked_color(packed_value), 1.0) : vec4(0.0);
    float is_found = step(surface, 0.75 * FAR);
    found += 0.25 * is_found;
    total += 0.25 * is_found * surface;
    slope += towards * surface;
  }
  slope *= 0.25 / BEYOND_REACH;
  vec3 right = vec3(light.world_to_shadow[0][0], light.world_to_shadow[1][0], light.world_to_shadow[2][0]);
  vec3 up = vec3(light.world_to_shadow[0][1], light.world_to_shadow[1][1], light.world_to_shadow[2][1]);
  normal = normalize(slope.x * normalize(right) + slope.y * normalize(up) + L);
  // A sloping surface is partly in front of a strand above it, so the mean depth is compared. The strand's side of a surface
  // in front of the strand is in shadow.
  return found * step(depth, total / max(found, 0.25) + SURFACE_BIAS);
}

// Fraction of light that `count` strands reflect, as in `layer_parts`.
vec3 reflected_by_hair(float count)
{
  vec3 reflectance = view.hair_reflectance.rgb;
  vec3 left = transmitted(2.0 * count, view.hair_forward.rgb);
  return reflectance * (vec3(1.0) - left) / (vec3(1.0) - reflectance * reflectance * left);
}

// Light of a colored surface relative to its first reflection: `count` strands above it reflect light back to the surface
// repeatedly.
vec3 between_hair_and_surface(vec3 color, float count)
{
  return vec3(1.0) / (vec3(1.0) - color * reflected_by_hair(count));
}

// Light that surfaces reflect to a strand, relative to uniform light, for unit irradiance of the light: through the rest of
// the hair, off diffuse surfaces, and through the hair again, along 1.66 times the shortest path [Elsasser42]. N, color: of
// the surfaces; part: their fraction of all directions.
vec3 surface_bounce(vec3 N, vec3 color, float part, vec3 L, vec3 T, float front, float behind)
{
  float cosine = max(dot(N, L), 0.0);
  // The width of strands is the sine of the angle between tangent and direction, pi / 4 averaged over all directions.
  float back = 1.66 * cosine * 0.25 * PI / max(sin_from_cos(dot(T, L)), 0.1);
  vec3 way = transmitted(front + behind * (1.0 + back), view.hair_forward.rgb);
  way *= between_hair_and_surface(color, front + behind);
  return color * way * (min(2.0 * part, 1.0) * cosine / PI);
}
