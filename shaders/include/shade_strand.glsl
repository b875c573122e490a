// SPDX-License-Identifier: GPL-3.0-or-later
// The main that every shading model includes: hair_bsdf() summed over the scene's lights, plus the world's light.
//
// vec3 hair_radiance(vec3 T, vec3 L, vec3 V, float count)  light leaving the fibre towards V for unit irradiance from L
//                                                          outside the hair, with a mean of `count` strands between
// vec3 hair_albedo()                                       what the fibre returns of a uniform surrounding

#include "include/fibre.glsl"
#include "include/shadow.glsl"
#include "include/world.glsl"

const float LEAST_IRRADIANCE = 1e-4;  // [W/m²]; less is not seen beside any light

void main()
{
  vec3 T = normalize(strand_tangent);
  vec3 V = view.is_perspective != 0 ? normalize(view.eye.xyz - drawn_position) : view.eye.xyz;
  // A fibre receives light in proportion to its sine with the direction, from either end alike.
  vec3 sides = vec3(sin_from_cos(T.x), sin_from_cos(T.y), sin_from_cos(T.z));
  vec3 radiance = world_light(drawn_position, sides, sides, view.hair_forward.rgb) * hair_albedo();
  for (int index = 0; index < lights.count; index++) {
    Light light = lights.light[index];
    vec3 L = to_light(light.kind, light.position.xyz, light.axis.xyz, drawn_position);
    vec3 irradiance = light_irradiance(light.kind,
                                       light.position.xyz,
                                       light.axis.xyz,
                                       light.power.rgb,
                                       light.cos_cone,
                                       light.blend,
                                       drawn_position);
    vec3 at;
    float depth;
    float count = 0.0;
    if (shadow_place(light, drawn_position, at, depth)) {
      irradiance *= lit_part(light, at, depth);
      count = crossed_strands(light, at, depth);
      radiance += irradiance * surface_bounce(light, at, depth, count) * hair_albedo();
    }
    // Most of a head of hair lies in the shadow of the rest, where nothing is left to scatter.
    vec3 arriving = irradiance * transmitted(count, view.hair_forward.rgb);
    if (max(arriving.r, max(arriving.g, arriving.b)) > LEAST_IRRADIANCE) {
      radiance += irradiance * hair_radiance(T, L, V, count);
    }
  }
  color = vec4(radiance, 1.0);
}
