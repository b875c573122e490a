// SPDX-License-Identifier: GPL-3.0-or-later
// Light among many fibres [Zinke08]: what strands in front pass on, and what those behind send back.

#include "include/longitudinal.glsl"

// How what comes back from behind a strand is spread over |phi|, with the integral pi; for light from one direction,
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

// Part of light that meets no strand where a mean of `count` stand in its way.
float direct_part(float count)
{
  return exp(-count);
}

// Part that arrives through at least one strand, each of which passes on a_f: the mean of a_f^k over a
// Poisson-distributed k >= 1.
vec3 scattered_part(float count, vec3 a_f)
{
  return exp(-count * (vec3(1.0) - a_f)) - vec3(exp(-count));
}
