// SPDX-License-Identifier: GPL-3.0-or-later
// Longitudinal scattering of a rough fiber: [DEon11] with the roughness of [Chiang16].

#include "fibre/fibre.glsl"
#include "fibre/scattering_kernel.glsl"

// M of a path, by sines and cosines of both inclinations; widening: added to the variance.
float m_lobe(int path, vec4 inclinations, float tilt, float tilt_trt, float roughness, float coat, float widening)
{
  float shift, variance;
  lobe_of(path, tilt, tilt_trt, roughness, coat, shift, variance);
  variance += widening;
  return shifted_lobe(inclinations.x, inclinations.y, inclinations.z, inclinations.w, shift, variance);
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
  vec4 inclinations = vec4(sin_theta_i, sin_from_cos(sin_theta_i), sin_theta_o, sin_from_cos(sin_theta_o));
  return vec4(m_lobe(0, inclinations, tilt, tilt_trt, roughness, coat, widening),
              m_lobe(1, inclinations, tilt, tilt_trt, roughness, coat, widening),
              m_lobe(2, inclinations, tilt, tilt_trt, roughness, coat, widening),
              m_lobe(3, inclinations, tilt, tilt_trt, roughness, coat, widening));
}
