// SPDX-License-Identifier: GPL-3.0-or-later
// Angles of a fiber. T is the tangent from root to tip; L and V point away from the fiber; all unit vectors.

#include "fibre/constants.glsl"

// Rounding can make a cosine greater than one, and the root of a negative number is NaN. The product of both factors keeps
// the digits that 1 - cosine² loses near one.
float sin_from_cos(float cosine)
{
  return sqrt(max(0.0, (1.0 - cosine) * (1.0 + cosine)));
}

// Legendre's polynomial of the second degree.
float legendre_2(float x)
{
  return 1.5 * x * x - 0.5;
}

// cos((theta_o - theta_i) / 2) from the sines of both inclinations: exact, by the half-angle formula.
float cos_theta_d(float sin_theta_i, float sin_theta_o)
{
  float cosines = sin_from_cos(sin_theta_i) * sin_from_cos(sin_theta_o);
  return sqrt(max(0.0, 0.5 * (1.0 + cosines + sin_theta_i * sin_theta_o)));
}

// Uniform light from below a plane with normal N on a fiber's mirror cone, sin(theta_i) = -sin(theta_o), softened as by
// roughness: the fraction of the cone, and its moment with the cosine of phi, both as factors of the fiber's response.
vec2 light_from_below(vec3 T, vec3 V, vec3 N)
{
  const float SOFTNESS = 0.05;
  float sin_o = dot(T, V);
  float t_dot_n = dot(T, N);
  float across = max((1.0 - sin_o * sin_o) * (1.0 - t_dot_n * t_dot_n), 0.0);
  float cosine = clamp(-sin_o * t_dot_n * inversesqrt(across + SOFTNESS), -1.0, 1.0);
  float sine = sin_from_cos(cosine);
  float cos_phi = -(dot(V, N) - sin_o * t_dot_n) * inversesqrt(across + SOFTNESS);
  return vec2(atan(sine, cosine), 2.0 * sine * cos_phi) / PI;
}

// |phi| in [0, pi]: the angle between L and V seen along the fiber. Zero where either is parallel to it.
float relative_azimuth(vec3 T, vec3 L, vec3 V)
{
  vec3 l = L - dot(T, L) * T;
  vec3 v = V - dot(T, V) * T;
  float across = abs(dot(T, cross(l, v)));
  float along = dot(l, v);
  // An arc cosine would lose half of the digits at 0 and pi, and has errors of at least 1e-3 with some drivers.
  return (max(across, abs(along)) < 1e-12) ? 0.0 : atan(across, along);
}
