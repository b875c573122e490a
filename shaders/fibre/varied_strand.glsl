// SPDX-License-Identifier: GPL-3.0-or-later
// Variation between and along strands at this sample: needs the sampler strand_randoms and the
// block variation.

#include "fibre/constants.glsl"
#include "surfaces/principled.glsl"
#include "strands/strand_variation.glsl"
#include "visibility/strand_hit.glsl"

float this_random()
{
  return texelFetch(strand_randoms, ivec2(strand_index % view.row_strands, strand_index / view.row_strands), 0).r;
}

float this_gradient()
{
  return tip_gradient(variation.gradient_start, variation.gradient_end, strand_position);
}

vec3 this_sigma_a()
{
  return sigma_a_along(variation, this_random(), this_gradient());
}

float this_roughness()
{
  return varied_roughness(settings.roughness, variation.random_roughness, this_random());
}
