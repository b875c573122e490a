// SPDX-License-Identifier: GPL-3.0-or-later
// Visibility of the lights from a surface, including its own shadow where it faces away.

#include "include/arrival.glsl"

void main()
{
  vec3 N = normalize(gl_FrontFacing ? surface_normal : -surface_normal);
  vec3 sent = vec3(0.0);
  vec3 arriving = vec3(0.0);
  for (int index = 0; index < lights.count; index++) {
    Light light = lights.light[index];
    float cosine = dot(N, to_light(light.kind, light.position.xyz, light.axis.xyz, drawn_position));
    vec3 irradiance = abs(cosine) * irradiance_of(light, drawn_position);
    sent += irradiance;
    if (cosine > 0.0) {
      arriving += irradiance * surface_visibility(light, drawn_position, view.hair_forward.rgb);
    }
  }
  color = vec4(part_of(arriving, sent), 1.0);
}
