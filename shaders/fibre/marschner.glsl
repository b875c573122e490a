// SPDX-License-Identifier: GPL-3.0-or-later
// [Marschner03] from baked tables: texture coordinates, and the sum of the lobes (Eq. 14).

#include "fibre/fibre.glsl"
#include "surfaces/principled.glsl"

const int AXES_ANGLES = 0;
const int AXES_COSINES = 1;

// Texture coordinates of M. ANGLES: theta_i, theta_o from -pi/2 to pi/2; COSINES: their sines from -1 to 1.
vec2 m_coordinates(float sin_theta_i, float sin_theta_o, int axes)
{
  vec2 sines = clamp(vec2(sin_theta_i, sin_theta_o), vec2(-1.0), vec2(1.0));
  if (axes == AXES_COSINES) {
    return 0.5 * sines + 0.5;
  }
  // The arc sine by atan, which drivers compute a hundred times more accurately.
  vec2 thetas = atan(sines, vec2(sin_from_cos(sines.x), sin_from_cos(sines.y)));
  return thetas / PI + 0.5;
}

// Texture coordinates of N and N_TRT. ANGLES: |phi| / pi, COSINES: (cos(phi) + 1) / 2; both over cos(theta_d).
vec2 n_coordinates(float phi, float cos_theta_d, int axes)
{
  float u = (axes == AXES_COSINES) ? 0.5 * cos(phi) + 0.5 : phi / PI;
  return vec2(u, cos_theta_d);
}

// beta_R of a longitudinal roughness in [0, 1], from 1 to 45 degrees.
float beta_r_of(float roughness)
{
  return clamp(0.5 * deviation_from_roughness(roughness), PI / 180.0, 0.25 * PI);
}

// M_R, M_TT, M_TRT: Gaussians of theta_h, of unit area in theta_o. tilt_trt: shift of TRT per tilt; blur: variance of the
// light's direction.
vec3 gaussian_lobes(float theta_h, float tilt, float tilt_trt, float beta_r, float blur)
{
  vec3 beta = sqrt(beta_r * beta_r * vec3(1.0, 0.25, 4.0) + vec3(0.25 * blur));
  vec3 x = vec3(theta_h) - tilt * vec3(-1.0, 0.5, tilt_trt);
  return 0.5 * vec3(gaussian(x.r, beta.r), gaussian(x.g, beta.g), gaussian(x.b, beta.b));
}

// S = sum over p of M_p N_p / cos²(theta_d), from texels m = (M_R, M_TT, M_TRT), n = (N_TT rgb, N_R), n_trt.
vec3 marschner_scattering(vec3 m, vec4 n, vec3 n_trt, float cos_theta_d)
{
  // cos(theta_d) only approaches zero for light along the fiber; the clamp keeps half floats finite.
  float cosine = max(cos_theta_d, 1e-3);
  return (m.r * vec3(n.a) + m.g * n.rgb + m.b * n_trt) / (cosine * cosine);
}
