// SPDX-License-Identifier: GPL-3.0-or-later
// First pass of a deep opacity map drawn as strips: the depth of the nearest, or farthest, strands from the light.

#include "shadows/opacity.glsl"

void main()
{
  Light light = lights.light[view.light_index];
  float depth = light_depth(light.kind, light.position.xyz, light.axis.xyz, light.near, light.extent, drawn_position);
  // Strands occluded by surfaces do not affect the layers' depths.
  if (depth > texelFetch(hidden_depth, ivec3(ivec2(gl_FragCoord.xy), light.shadow_layer), 0).r) {
    discard;
  }
  front = front_bits(depth);
}
