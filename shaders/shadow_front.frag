// SPDX-License-Identifier: GPL-3.0-or-later
// First pass of a shadow map: the depth of what the light meets first.

#include "include/opacity.glsl"

void main()
{
  Light light = lights.light[view.light_index];
  color = vec4(light_depth(light.kind, light.position.xyz, light.axis.xyz, drawn_position), 0.0, 0.0, 1.0);
}
