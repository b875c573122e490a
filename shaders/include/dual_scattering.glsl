// SPDX-License-Identifier: GPL-3.0-or-later
// Dual scattering [Zinke08]: forward scattering by strands in front, backscattering by strands behind.

#include "include/longitudinal.glsl"

// Azimuthal distribution of backscattered light over |phi|, with the integral pi; for light from one direction,
// and for light from a half circle, the mean of the first over it.
float back_azimuth(float phi)
{
  return 1.0 - phi / PI;
}

float spread_back_azimuth(float phi)
{
  float turn = phi / PI;
  return (turn < 0.5) ? 0.75 - turn * turn : 0.25 + (1.0 - turn) * (1.0 - turn);
}

// Unscattered part of light behind a mean of `count` strands.
float direct_part(float count)
{
  return exp(-count);
}

// Part that arrives through at least one strand, each with the forward scattering a_f: the mean of a_f^k over a
// Poisson-distributed k >= 1.
vec3 scattered_part(float count, vec3 a_f)
{
  return exp(-count * (vec3(1.0) - a_f)) - vec3(exp(-count));
}
