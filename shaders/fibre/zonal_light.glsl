// SPDX-License-Identifier: GPL-3.0-or-later
// Response of a fiber to nonuniform light, relative to the response to uniform light.

#include "fibre/constants.glsl"

// Response to light that varies with the inclination as exp(b sin(theta_i)), which is positive even if little is visible.
// first: the light's mean of sin(theta_i); second: its mean of Legendre's polynomial P2, whose remainder is added;
// zonal_1, zonal_2: the responses to P1 and P2, relative to uniform light.
vec3 zonal_part(float first, float second, vec3 zonal_1, vec3 zonal_2)
{
  float m = clamp(first, -0.95, 0.95);
  float b = m * (3.0 - m * m) / (1.0 - m * m);  // Banerjee et al. 2005
  b = (abs(b) < 1e-3) ? 1e-3 : b;
  // The mean of P2, for nearly uniform light without the difference of nearly equal numbers.
  float expected = (abs(b) < 0.3) ? b * b / 15.0 : 1.0 - 3.0 / b * (1.0 / tanh(b) - 1.0 / b);
  // Scattering with this variance of sin(theta_i), at most that of scattering to the poles only.
  vec3 variance = max((2.0 * zonal_2 + 1.0) / 3.0 - zonal_1 * zonal_1, vec3(0.0));
  vec3 part = b / sinh(b) * min(exp(b * zonal_1 + 0.5 * b * b * variance), cosh(b) + sinh(b) * zonal_1);
  return max(part + 5.0 * (second - expected) * zonal_2, vec3(0.0));
}

// The modified Bessel function I0, within 0.6 % (Olivares et al. 2018).
vec3 bessel_i0(vec3 x)
{
  vec3 squared = x * x;
  return cosh(x) / sqrt(sqrt(1.0 + 0.25 * squared)) * (1.0 + 0.24273 * squared) / (1.0 + 0.43023 * squared);
}

// Response to light that varies with the azimuth, relative to uniform light. first: mean cosine of the azimuth phi of the
// light, relative to the viewer; turned: mean of cos(phi) over the light that the fiber scatters. Reflected light is spread
// widely: the first harmonic. Transmitted light comes from straight behind: light is assumed to vary as exp(k cos(phi)).
vec3 azimuthal_part(vec3 first, vec3 turned)
{
  vec3 m = clamp(first, vec3(-0.95), vec3(0.95));
  vec3 k = m * (2.0 - m * m) / (1.0 - m * m);  // Banerjee et al. 2005
  vec3 reflected = 1.0 + 2.0 * m * max(turned, vec3(0.0));
  return max(reflected, vec3(0.0)) * mix(vec3(1.0), exp(-k) / bessel_i0(k), max(-turned, vec3(0.0)));
}
