// SPDX-License-Identifier: GPL-3.0-or-later
// Angles of a fibre. T is the tangent from root to tip; L and V point away from the fibre; all unit vectors.

#include "include/constants.glsl"

// Rounding can carry a cosine past one; the root of a negative number is not a number.
float sin_from_cos(float cosine)
{
  return sqrt(max(0.0, 1.0 - cosine * cosine));
}

// cos((theta_o - theta_i) / 2) from the sines of both inclinations: exact, by the half-angle formula.
float cos_theta_d(float sin_theta_i, float sin_theta_o)
{
  float cosines = sin_from_cos(sin_theta_i) * sin_from_cos(sin_theta_o);
  return sqrt(max(0.0, 0.5 * (1.0 + cosines + sin_theta_i * sin_theta_o)));
}

// |phi| in [0, pi]: the angle between L and V seen along the fibre. Zero where either is parallel to it.
float relative_azimuth(vec3 T, vec3 L, vec3 V)
{
  vec3 l = L - dot(T, L) * T;
  vec3 v = V - dot(T, V) * T;
  float lengths = sqrt(dot(l, l) * dot(v, v));
  if (lengths < 1e-9) {
    return 0.0;
  }
  return acos(clamp(dot(l, v) / lengths, -1.0, 1.0));
}
