// SPDX-License-Identifier: GPL-3.0-or-later
// Solid shading with a color type other than Material, or with a matcap: needs the block solid and the samplers strand_tints
// and matcap, which has the layer of highlights above that of diffuse light.

#include "fibre/solid_tint.glsl"

const float LEAST_TINT = 1e-3;

vec3 strand_tint()
{
  ivec2 texel = ivec2(strand_index % view.row_strands, strand_index / view.row_strands);
  vec3 tint = (solid.has_strand_tints != 0) ? texelFetch(strand_tints, texel, 0).rgb : solid_tint();
  return max(tint, vec3(LEAST_TINT));
}

// Highlights keep their color: `shown_light` multiplies them by the tint.
vec3 shown_highlight()
{
  return 1.0 / strand_tint();
}

// Both layers of the matcap for a unit normal: Blender's place in the image, for the view direction V.
void matcap_at(vec3 N, vec3 V, vec3 right, vec3 up, out vec3 diffuse, out vec3 specular)
{
  vec2 towards = vec2(dot(V, right), dot(V, up));
  vec2 normal = vec2(dot(N, right), dot(N, up));
  float ahead = 1.0 + dot(V, cross(right, up));
  // Turns the view direction to the axis of the image.
  vec2 place = normal - towards * (dot(normal, towards) / ahead + dot(N, cross(right, up)));
  vec2 at = clamp(0.496 * place + 0.5, 0.0, 1.0);
  float row = clamp(at.y, 0.002, 0.998);
  diffuse = textureLod(matcap, vec2(at.x, 0.5 * row), 0.0).rgb;
  specular = textureLod(matcap, vec2(at.x, 0.5 * row + 0.5), 0.0).rgb;
}

// Mean of a matcap over the visible width of a strand. Its normals lean to where the world is open, so that hair has the
// shape of the surface around it: those of strands that stand up alone would lean to the other side.
const float LEAN = 1.0;

vec3 matcap_light(vec3 light, vec3 T, vec3 V, vec3 returned, vec3 open)
{
  vec3 ahead = vec3(view.world_to_clip[0][3], view.world_to_clip[1][3], view.world_to_clip[2][3]);
  vec3 right = vec3(view.world_to_clip[0][0], view.world_to_clip[1][0], view.world_to_clip[2][0]);
  vec3 up = vec3(view.world_to_clip[0][1], view.world_to_clip[1][1], view.world_to_clip[2][1]);
  if (view.is_perspective != 0) {  // a shifted lens
    right -= ahead * (dot(right, ahead) / dot(ahead, ahead));
    up -= ahead * (dot(up, ahead) / dot(ahead, ahead));
  }
  right = normalize(right);
  up = normalize(up);
  vec3 across = cross(V, T);
  float sine = length(across);
  across = (sine > 1e-4) ? across / sine : right;
  vec3 facing = normalize(mix(V, cross(T, across), sine));
  vec3 outside = open * inversesqrt(max(dot(open, open), 1e-8));
  outside = normalize(outside + max(0.0, -dot(outside, V)) * V + 1e-4 * V);  // on the visible side
  const int TAPS = 5;
  vec3 diffuse_sum = vec3(0.0);
  vec3 specular_sum = vec3(0.0);
  for (int tap = 0; tap < TAPS; tap++) {
    float h = (2.0 * float(tap) + 1.0) / float(TAPS) - 1.0;
    vec3 diffuse;
    vec3 specular;
    matcap_at(normalize(sqrt(1.0 - h * h) * facing + h * across + LEAN * outside), V, right, up, diffuse, specular);
    diffuse_sum += diffuse;
    specular_sum += specular;
  }
  // Highlights fade less in depth than color does.
  float lit = sqrt(clamp(dot(light, vec3(1.0)) / max(dot(returned, vec3(1.0)), 1e-4), 0.0, 1.0));
  return (light * strand_tint() * diffuse_sum + solid.highlights * lit * specular_sum) / float(TAPS);
}

vec3 shown_light(vec3 light, vec3 T, vec3 V, vec3 returned, vec3 open)
{
  return (solid.has_matcap != 0) ? matcap_light(light, T, V, returned, open) : light * strand_tint();
}
