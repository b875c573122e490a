// SPDX-License-Identifier: GPL-3.0-or-later
// `pigment.color_falloff` of each strand, in place of fibre/look_falloff.glsl where a map varies the radial roughness.

#include "fibre/strand_radial.glsl"

// The fit of [Chiang16] to path-traced grooms.
float this_falloff()
{
  float b = this_radial_roughness();
  return 5.969 + b * (-0.215 + b * (2.532 + b * (-10.73 + b * (5.574 + b * 0.245))));
}
