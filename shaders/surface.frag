// SPDX-License-Identifier: GPL-3.0-or-later
// The surface under the hair: diffuse, in the scene's light.

#include "include/shadow.glsl"
#include "include/world.glsl"

void main()
{
  vec3 N = normalize(gl_FrontFacing ? surface_normal : -surface_normal);
  mat3 plus;
  mat3 minus;
  world_sides(corner_seen_x_y, corner_seen_z, view.seen_opacity, view.hair_forward.rgb, plus, minus);
  vec3 irradiance = surface_irradiance(plus, minus, N);
  for (int index = 0; index < lights.count; index++) {
    Light light = lights.light[index];
    vec3 L = to_light(light.kind, light.position.xyz, light.axis.xyz, drawn_position);
    float cosine = dot(N, L);
    if (cosine > 0.0) {
      vec3 facing = light_irradiance(light.kind,
                                     light.position.xyz,
                                     light.axis.xyz,
                                     light.power.rgb,
                                     light.cos_cone,
                                     light.blend,
                                     light.radius,
                                     drawn_position);
      irradiance += cosine * facing * surface_visibility(light, drawn_position, view.hair_forward.rgb);
    }
  }
  color = vec4(surface_color * irradiance / PI, 1.0);
}
