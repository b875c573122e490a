// SPDX-License-Identifier: GPL-3.0-or-later
// [Kajiya89], as in [Report12] Eq. 11-12 with the second sine and the sign corrected: see DECISIONS.md.

#include "include/fibre.glsl"

// Eq. 11: a diffuse cylinder receives light in proportion to the sine between tangent and light.
float kajiya_kay_diffuse(vec3 T, vec3 L)
{
  return sin_from_cos(dot(T, L));
}

// Eq. 12: cos(theta_i + theta_o) to a power, one on the mirror cone.
float kajiya_kay_specular(vec3 T, vec3 L, vec3 V, float exponent)
{
  float t_dot_l = dot(T, L);
  float t_dot_v = dot(T, V);
  float cone = sin_from_cos(t_dot_l) * sin_from_cos(t_dot_v) - t_dot_l * t_dot_v;
  return pow(max(0.0, cone), exponent);
}

// What the highlight returns of a uniform surrounding, the mean over all directions of view: with s = theta_i + theta_o
// it is pi/2 times the integral of cos(s)^exponent ((pi - |s|) cos(s) + sin|s|), and close to pi²/2 times that of
// cos(s)^(exponent + 1). Within 0.5 % for an exponent of 10 and more, 5 % for 1.
float kajiya_kay_specular_albedo(float exponent)
{
  return 0.5 * PI * PI * sqrt(2.0 * PI / (exponent + 1.5));
}
