// SPDX-License-Identifier: GPL-3.0-or-later
// Second pass of a deep opacity map: each strand adds its coverage to its layer and all deeper layers.

#include "shadows/opacity.glsl"

void main()
{
  Light light = lights.light[view.light_index];
  float depth = light_depth(light.kind, light.position.xyz, light.axis.xyz, light.near, light.extent, drawn_position);
  ivec2 here = ivec2(gl_FragCoord.xy);
  vec2 ends = texelFetch(hair_front, ivec3(here, light.shadow_layer), 0).rg;
  int layer = layer_among(depth, ends, texelFetch(hidden_depth, ivec3(here, light.shadow_layer), 0).r);
  color = vec4(lessThan(vec4(float(layer)), vec4(0.5, 1.5, 2.5, 3.5))) * strand_coverage;
}
