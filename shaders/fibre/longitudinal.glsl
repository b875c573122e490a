// SPDX-License-Identifier: GPL-3.0-or-later
// Longitudinal scattering of a rough fibre: [DEon11] with the roughness of [Chiang16].

#include "fibre/fibre.glsl"
#include "surfaces/principled.glsl"

// exp(-x) I0(x) for x >= 0 [Abramowitz64, 9.8.1-2].
float i0e(float x)
{
  float t = x / 3.75;
  if (t <= 1.0) {
    float s = t * t;
    float series = 0.2659732 + s * (0.0360768 + s * 0.0045813);
    return exp(-x) * (1.0 + s * (3.5156229 + s * (3.0899424 + s * (1.2067492 + s * series))));
  }
  float r = 1.0 / t;
  float series = 0.00916281 + r * (-0.02057706 + r * (0.02635537 + r * (-0.01647633 + r * 0.00392377)));
  return (0.39894228 + r * (0.01328592 + r * (0.00225319 + r * (-0.00157565 + r * series)))) / sqrt(x);
}

// M_v; v: variance in theta_i + theta_o.
float d_eon_lobe(float sin_i, float cos_i, float sin_o, float cos_o, float v)
{
  float along = sin_i + sin_o;
  float across = cos_i - cos_o;
  float beside_cone = -0.5 * (along * along + across * across);
  return i0e(cos_i * cos_o / v) * exp(beside_cone / v) / (v * (1.0 - exp(-2.0 / v)));
}

// One lobe of m_lobes(): the view's inclination shifted back by the lobe's tilt.
float shifted_lobe(float sin_i, float cos_i, float sin_o, float cos_o, float shift, float v)
{
  float sin_turned = sin_o * cos(shift) - cos_o * sin(shift);
  float cos_turned = abs(cos_o * cos(shift) + sin_o * sin(shift));
  return d_eon_lobe(sin_i, cos_i, sin_turned, cos_turned, v);
}

// M_R, M_TT, M_TRT and M of the residual; tilt_trt: shift of TRT per tilt, in theta_i + theta_o; widening: added
// to each variance.
vec4 m_lobes(float sin_theta_i,
             float sin_theta_o,
             float tilt,
             float tilt_trt,
             float roughness,
             float coat,
             float widening)
{
  float cos_i = sin_from_cos(sin_theta_i);
  float cos_o = sin_from_cos(sin_theta_o);
  float v = variance_from_roughness(roughness);
  float v_r = variance_from_roughness((1.0 - coat) * roughness);
  return vec4(shifted_lobe(sin_theta_i, cos_i, sin_theta_o, cos_o, -2.0 * tilt, v_r + widening),
              shifted_lobe(sin_theta_i, cos_i, sin_theta_o, cos_o, tilt, max(0.25 * v, 1e-4) + widening),
              shifted_lobe(sin_theta_i, cos_i, sin_theta_o, cos_o, tilt_trt * tilt, 4.0 * v + widening),
              d_eon_lobe(sin_theta_i, cos_i, sin_theta_o, cos_o, 4.0 * v + widening));
}
