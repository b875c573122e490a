// SPDX-License-Identifier: GPL-3.0-or-later
// The energy-conserving model [DEon11] [Chiang16] among other strands [Zinke08], for models that define
//
// float fibre_roughness()               longitudinal
// FibreLobes fibre_lobes(vec2 at)       N, for light from one direction, at coordinates of `n_coordinates`
// FibreLobes half_circle_lobes(vec2 at) N, for light from a half circle
// vec3 dual(int row, float theta_i)     what the strands around do, rows as in `dual_scattering.QUANTITIES`

#include "include/drawn_light.glsl"
#include "include/dual_scattering.glsl"
#include "include/marschner.glsl"

float mean(vec3 rgb)
{
  return (rgb.r + rgb.g + rgb.b) / 3.0;
}

vec4 fibre_m(float sin_i, float sin_o, float widening)
{
  float tilt_trt = settings.shifts == 0 ? 4.0 : 3.0;
  return m_lobes(sin_i, sin_o, settings.tilt, tilt_trt, fibre_roughness(), settings.coat, widening);
}

vec3 hair_bsdf(vec3 T, vec3 L, vec3 V, float blur)
{
  float sin_o = dot(T, V);
  vec2 at = n_coordinates(relative_azimuth(T, L, V), sin_from_cos(sin_o), settings.axes);
  return lobe_sum(drawn_lobes * fibre_m(dot(T, L), sin_o, blur), fibre_lobes(at));
}

// `dual_scattering.radiance`. Shifts and widths are the mean over the channels, which differ little in them.
vec3 hair_radiance(vec3 T, vec3 L, vec3 V, float count, float blur)
{
  float sin_i = dot(T, L);
  float sin_o = dot(T, V);
  float cos_i = sin_from_cos(sin_i);
  float cos_o = sin_from_cos(sin_o);
  float theta_i = atan(sin_i, cos_i);
  float phi = relative_azimuth(T, L, V);

  float beta_f = mean(dual(4, theta_i));
  vec3 back = drawn_lobes.w * dual(6, theta_i) * (view.back_gain / PI);
  float back_shift = 2.0 * mean(dual(7, theta_i));
  float back_width = mean(dual(8, theta_i));
  // Variances of theta_h are quarters of those of theta_i + theta_o.
  float back_v = 4.0 * back_width * back_width + blur;
  float spread = 4.0 * count * beta_f * beta_f;
  vec3 direct = hair_bsdf(T, L, V, blur) +
                back * back_azimuth(phi) * shifted_lobe(sin_i, cos_i, sin_o, cos_o, back_shift, back_v);

  vec2 at = n_coordinates(phi, cos_o, settings.axes);
  vec3 through = drawn_lobes.w * lobe_sum(fibre_m(sin_i, sin_o, spread + blur), half_circle_lobes(at));
  vec3 back_spread = back * spread_back_azimuth(phi) *
                     shifted_lobe(sin_i, cos_i, sin_o, cos_o, back_shift, back_v + spread);
  return direct_part(count) * direct + scattered_part(count, dual(0, theta_i)) * (through + back_spread);
}
