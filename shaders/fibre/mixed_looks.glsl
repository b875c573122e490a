// SPDX-License-Identifier: GPL-3.0-or-later
// The share of a look in a sample, by the wetness of its strand: the driest look is drawn first, then the wettest look is
// added. Needs the sampler strand_wetness, the image picture and the constants wetness_range and is_wet.

#include "fibre/wet_share.glsl"

float look_share(int strand)
{
  ivec2 texel = ivec2(strand % view.row_strands, strand / view.row_strands);
  float share = wet_share(texelFetch(strand_wetness, texel, 0).r, wetness_range.x, wetness_range.y);
  return (is_wet != 0) ? share : 1.0 - share;
}

vec4 mixed_light(ivec2 place, vec4 light, float share)
{
  vec3 before = (is_wet != 0 && share < 1.0) ? imageLoad(picture, place).rgb : vec3(0.0);
  return vec4(before + share * light.rgb, light.a);
}
