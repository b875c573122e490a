// SPDX-License-Identifier: GPL-3.0-or-later
// The share of a look in a sample: all. The two programs for hair that is wet in places include fibre/mixed_looks.glsl in
// place of this file.

float look_share(int strand)
{
  return 1.0;
}

vec4 mixed_light(ivec2 place, vec4 light, float share)
{
  return light;
}
