// SPDX-License-Identifier: GPL-3.0-or-later
// Reads the shadow maps of a light: needs the samplers hair_front, hair_layers, surface_moments.

#include "include/opacity.glsl"

// Range around a strand, as a part of the map, and behind it, as a part of the hair, in which surfaces light it.
const float BOUNCE_REACH = 0.025;
const float BOUNCE_DISTANCE = 0.25;

// Range around a strand, as a part of the map, in which the strands behind it are counted.
const float BEHIND_REACH = 0.01;

// Depth bias of surfaces, as a part of the hair's extent.
const float SURFACE_BIAS = 0.01;

// Place of a point in a light's maps, and its depth; false where the maps do not reach: they hold the hair and what is
// near it.
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

// Visibility of the light past surfaces: the upper bound of the part with a greater depth [Donnelly06].
float lit_part(vec3 at, float depth)
{
  vec2 moments = textureLod(surface_moments, at, 0.0).rg;
  float warped = warped_depth(depth - SURFACE_BIAS);
  float behind = warped - moments.x;
  float rounding = 0.3 * SURFACE_BIAS * WARP * warped;
  float variance = max(moments.y - moments.x * moments.x, rounding * rounding);
  // Where one surface is behind another, the bound is not tight: its tail is cut off.
  float part = clamp((variance / (variance + behind * behind) - 0.05) / 0.95, 0.0, 1.0);
  return (behind <= 0.0) ? 1.0 : part;
}

// Mean number of strands that the light has crossed.
float crossed_strands(vec3 at, float depth)
{
  float behind = max(0.0, depth - textureLod(hair_front, at, 0.0).r);
  return strands_in_front(textureLod(hair_layers, at, 0.0), behind);
}

// Mean number of strands behind a depth, as far as the surface there: the mean over points around, of which a strand at
// this place covers none.
float strands_behind(vec3 at, float depth)
{
  float total = 0.0;
  for (int corner = 0; corner < 4; corner++) {
    vec3 near = at + vec3(BEHIND_REACH * (2.0 * vec2(float(corner & 1), float(corner >> 1)) - 1.0), 0.0);
    float front = textureLod(hair_front, near, 0.0).r;
    float surface = textureLod(surface_moments, near, 0.0).b;
    vec4 counts = textureLod(hair_layers, near, 0.0);
    total += max(0.0, strands_in_front(counts, surface - front) - strands_in_front(counts, depth - front));
  }
  return 0.25 * total;
}

// Part of the light stopped by a surface near enough to light a strand from below: the mean over points around it,
// which softens the surface's border.
float surface_under(vec3 at, float depth)
{
  float barred = 0.0;
  for (int corner = 0; corner < 4; corner++) {
    vec2 offset = BOUNCE_REACH * (2.0 * vec2(float(corner & 1), float(corner >> 1)) - 1.0);
    float distance_to = textureLod(surface_moments, at + vec3(offset, 0.0), 0.0).b - depth;
    barred += 1.0 - smoothstep(0.0, BOUNCE_DISTANCE, distance_to);
  }
  return 0.25 * barred;
}

// Light reflected to a strand from the surface below, for unit irradiance of the light: through the rest
// of the hair, off a diffuse surface, and through the hair again.
vec3 surface_bounce(vec3 at, float depth, float count)
{
  float surface = min(textureLod(surface_moments, at, 0.0).b, depth + BOUNCE_DISTANCE);
  float under = max(0.0, crossed_strands(at, surface) - count);
  vec3 way = transmitted(count + 2.0 * under, view.hair_forward.rgb);
  // The mean cosine of a surface that is lit is 2/3, and it fills half of what a strand sees.
  return view.surface_color.rgb * way * surface_under(at, depth) * (2.0 / 3.0) * 0.5 / PI;
}

// Visibility of a light from a surface: the mean over 3 × 3 texels. forward: the forward scattering of one strand.
vec3 surface_visibility(Light light, vec3 position, vec3 forward)
{
  vec3 at;
  float depth;
  if (!shadow_place(light, position, at, depth)) {
    return vec3(1.0);
  }
  float texel = 1.0 / float(textureSize(hair_front, 0).x);
  vec3 total = vec3(0.0);
  for (int y = -1; y <= 1; y++) {
    for (int x = -1; x <= 1; x++) {
      vec3 near = at + vec3(float(x), float(y), 0.0) * texel;
      total += lit_part(near, depth) * transmitted(crossed_strands(near, depth), forward);
    }
  }
  return total / 9.0;
}
