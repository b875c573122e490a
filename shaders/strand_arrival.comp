// SPDX-License-Identifier: GPL-3.0-or-later
// Visibility of the lights from strands: one if unoccluded, zero in full shadow.

#include "include/arrival.glsl"
#include "include/this_place.glsl"

vec4 sample_value()
{
  vec3 sent = vec3(0.0);
  vec3 arriving = vec3(0.0);
  for (int index = 0; index < lights.count; index++) {
    Light light = lights.light[index];
    vec3 irradiance = irradiance_of(light, drawn_position);
    vec3 at;
    float depth;
    vec3 L = to_light(light.kind, light.position.xyz, light.axis.xyz, drawn_position);
    vec3 part = vec3(1.0);
    if (shadow_place(light, drawn_position, at, depth)) {
      float behind;
      float own = own_count(light, drawn_position, drawn_radius);
      part = lit_part(at, depth, strand_bias(root_direction(strand_index), L)) *
             transmitted(crossed_strands(at, depth, own, behind), view.hair_forward.rgb);
    }
    sent += irradiance;
    arriving += irradiance * part;
  }
  return vec4(part_of(arriving, sent), 1.0);
}

#include "include/strand_samples.glsl"
