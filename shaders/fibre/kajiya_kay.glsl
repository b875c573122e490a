// SPDX-License-Identifier: GPL-3.0-or-later
// [Kajiya89], as in [Report12] Eq. 11-12 with the second sine and the sign corrected: see DECISIONS.md.

#include "fibre/fibre.glsl"
#include "surfaces/principled.glsl"

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

// Directional albedo of the highlight under uniform light, averaged over all view directions: with
// s = theta_i + theta_o it is pi/2 times the integral of cos(s)^exponent ((pi - |s|) cos(s) + sin|s|), approximated by
// pi²/2 times the integral of cos(s)^(exponent + 1). Within 0.5 % for exponents of 10 and more, 5 % for 1.
float kajiya_kay_specular_albedo(float exponent)
{
  return 0.5 * PI * PI * sqrt(2.0 * PI / (exponent + 1.5));
}

// Response of a diffuse cylinder and a mirror cone to light that varies as P1 and P2 of sin(theta_i); diffuse, specular:
// albedos in uniform light.
void kajiya_kay_zonal(vec3 diffuse, vec3 specular, float sin_theta_o, out vec3 zonal_1, out vec3 zonal_2)
{
  zonal_1 = -sin_theta_o * specular;
  zonal_2 = legendre_2(sin_theta_o) * specular - 0.125 * diffuse;
}

// Exponent of a highlight from light with an angular variance: the variance of a highlight is close to 1 / exponent.
float blurred_exponent(float exponent, float blur)
{
  return exponent / (1.0 + exponent * blur);
}

// Exponent of a highlight with the width of the R lobe of a longitudinal roughness.
float highlight_exponent(float roughness)
{
  return clamp(1.0 / variance_from_roughness(roughness), 1.0, 10000.0);
}

// Peak of a highlight whose directional albedo under uniform light is `reflectance`.
float highlight_peak(float reflectance, float exponent)
{
  return min(reflectance / kajiya_kay_specular_albedo(exponent), 1.0);
}

// Color of multiply scattered light in hair [Chiang16].
vec3 color_from_falloff(vec3 sigma_a, float falloff)
{
  return exp(-falloff * sqrt(sigma_a));
}
