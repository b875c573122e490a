// SPDX-License-Identifier: GPL-3.0-or-later
// The radial roughness of the strand at this sample, as a map gives it: needs the sampler strand_radial.

#include "visibility/strand_hit.glsl"

float this_radial_roughness()
{
  return texelFetch(strand_radial, ivec2(strand_index % view.row_strands, strand_index / view.row_strands), 0).r;
}
