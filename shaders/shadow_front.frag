// SPDX-License-Identifier: GPL-3.0-or-later
// First pass of a deep opacity map drawn as strips: the depth of the strands that the light meets first.

#include "include/opacity.glsl"

void main()
{
  Light light = lights.light[view.light_index];
  front = front_bits(
      light_depth(light.kind, light.position.xyz, light.axis.xyz, light.near, light.extent, drawn_position));
}
