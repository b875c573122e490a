// SPDX-License-Identifier: GPL-3.0-or-later
// Visibility of the lights from strands: one if unoccluded, zero in full shadow.

#include "light/strand_irradiance.glsl"

vec4 sample_value()
{
  vec3 sent = vec3(0.0);
  vec3 arriving = vec3(0.0);
  vec3 root = root_direction(strand_index);
  for (int index = 0; index < lights.count; index++) {
    LampLight lamp = lamp_on_strand(lights.light[index], root);
    count_strands(lights.light[index], lamp);
    sent += lamp.irradiance;
    arriving += lamp.irradiance * lamp.open * transmitted(lamp.front, view.hair_forward.rgb);
  }
  return vec4(part_of(arriving, sent), 1.0);
}

#include "visibility/strand_samples.glsl"
