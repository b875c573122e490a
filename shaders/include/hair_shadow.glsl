// SPDX-License-Identifier: GPL-3.0-or-later
// Part of the irradiance of a matt surface that hair lets through.

#include "include/arrival.glsl"
#include "include/world.glsl"

vec3 part_past_hair()
{
  vec3 N = normalize(gl_FrontFacing ? surface_normal : -surface_normal);
  mat3 plus;
  mat3 minus;
  world_sides(corner_seen_x_y, corner_seen_z.xy, view.seen_opacity, view.hair_forward.rgb, plus, minus);
  vec3 past_hair = surface_irradiance(plus, minus, N);
  // Of the world's light about as much as of all directions that surfaces leave open.
  float part = corner_seen_z.w / max(corner_seen_z.z, 1e-6);
  vec3 past_surfaces = past_hair / seen_through(part, view.seen_opacity, view.hair_forward.rgb);
  for (int index = 0; index < lights.count; index++) {
    Light light = lights.light[index];
    float cosine = dot(N, to_light(light.kind, light.position.xyz, light.axis.xyz, drawn_position));
    if (cosine > 0.0) {
      vec3 irradiance = cosine * irradiance_of(light, drawn_position);
      past_hair += irradiance * surface_visibility(light, drawn_position, view.hair_forward.rgb);
      past_surfaces += irradiance * surface_visibility(light, drawn_position, vec3(1.0));
    }
  }
  // Where no light arrives there is none to stop.
  return mix(vec3(1.0), part_of(past_hair, past_surfaces), vec3(greaterThan(past_surfaces, vec3(1e-12))));
}
