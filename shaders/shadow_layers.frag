// SPDX-License-Identifier: GPL-3.0-or-later
// Second pass of a deep opacity map: each strand adds its coverage to its own layer and all deeper ones.

#include "include/opacity.glsl"

void main()
{
  Light light = lights.light[view.light_index];
  float depth = light_depth(light.kind, light.position.xyz, light.axis.xyz, light.near, light.extent, drawn_position);
  float front = texelFetch(hair_front, ivec3(ivec2(gl_FragCoord.xy), light.shadow_layer), 0).r;
  color = layers_behind(depth - front) * strand_coverage;
}
