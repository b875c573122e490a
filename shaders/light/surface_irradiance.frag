// SPDX-License-Identifier: GPL-3.0-or-later
// Visibility of the lights from a surface, including its own shadow where it faces away. Limited to one, as hair reflects
// light to where a light grazes a surface.

#include "light/irradiance.glsl"
#include "surfaces/drawn_normal.glsl"
#include "shadows/surface_visibility.glsl"

void main()
{
  vec3 N = drawn_normal();
  vec3 sent = vec3(0.0);
  vec3 arriving = vec3(0.0);
  vec2 turn = sample_turn(picture_place(ivec2(gl_FragCoord.xy)));
  for (int index = 0; index < lights.count; index++) {
    Light light = lights.light[index];
    vec3 irradiance = irradiance_of(light, drawn_position);
    sent += irradiance * abs(dot(N, to_light(light.kind, light.position.xyz, light.axis.xyz, drawn_position)));
    arriving += irradiance * surface_visibility(light, drawn_position, N, view.hair_forward.rgb, turn).past_hair;
  }
  color = vec4(min(part_of(arriving, sent), vec3(1.0)), 1.0);
}
