// SPDX-License-Identifier: GPL-3.0-or-later
// The look of each strand at this sample, as maps give it, in place of fibre/varied_strand.glsl: needs the sampler strand_looks
// with two texels per strand, (absorption at the root, factor of the roughness) and (absorption at the tip, random number),
// and the block variation.

#include "fibre/constants.glsl"
#include "surfaces/principled.glsl"
#include "strands/strand_variation.glsl"
#include "visibility/strand_hit.glsl"

vec4 look_texel(int place)
{
  ivec2 at = ivec2(2 * (strand_index % view.row_strands) + place, strand_index / view.row_strands);
  return texelFetch(strand_looks, at, 0);
}

float this_random()
{
  return look_texel(1).a;
}

float this_gradient()
{
  return tip_gradient(variation.gradient_start, variation.gradient_end, strand_position);
}

vec3 this_sigma_a()
{
  return mix(look_texel(0).rgb, look_texel(1).rgb, this_gradient());
}

float this_roughness()
{
  return varied_roughness(settings.roughness * look_texel(0).a, variation.random_roughness, this_random());
}
