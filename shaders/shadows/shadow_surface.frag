// SPDX-License-Identifier: GPL-3.0-or-later
// The depth and color of the surfaces nearest to a light.

#include "shadows/opacity.glsl"

void main()
{
  Light light = lights.light[view.light_index];
  float depth = light_depth(light.kind, light.position.xyz, light.axis.xyz, light.near, light.extent, drawn_position);
  color = vec4(min(depth, FAR_SURFACE), view.surface_color, 0.0, 1.0);
}
