// SPDX-License-Identifier: GPL-3.0-or-later
// The energy-conserving Marschner model [DEon11] [Chiang16]: M evaluated, N from baked tables at theta_o.

#include "include/dual_scattering.glsl"
#include "include/marschner.glsl"

vec3 hair_bsdf(vec3 T, vec3 L, vec3 V)
{
  float sin_theta_o = dot(T, V);
  float tilt_trt = settings.shifts == 0 ? 4.0 : 3.0;
  vec4 m = m_lobes(dot(T, L), sin_theta_o, settings.tilt, tilt_trt, settings.roughness, settings.coat);
  vec2 at = n_coordinates(relative_azimuth(T, L, V), sin_from_cos(sin_theta_o), settings.axes);
  vec4 n = textureLod(n_table, at, 0.0);
  vec3 n_trt = textureLod(n_trt_table, at, 0.0).rgb;
  vec3 n_res = textureLod(n_res_table, vec2(0.5, at.y), 0.0).rgb;
  // The cosine of theta_i is in M.
  return m.x * vec3(n.a) + m.y * n.rgb + m.z * n_trt + m.w * n_res;
}

// A row of the dual scattering table, as `dual_scattering.QUANTITIES` orders them, at the light's inclination.
vec3 dual(int row, float theta_i)
{
  return textureLod(dual_table, vec2(theta_i / PI + 0.5, (float(row) + 0.5) / 9.0), 0.0).rgb;
}

float mean(vec3 rgb)
{
  return (rgb.r + rgb.g + rgb.b) / 3.0;
}

// `dual_scattering.sample_radiance`. Shifts and widths are the mean over the channels, which differ little in them.
vec3 hair_radiance(vec3 T, vec3 L, vec3 V, float count)
{
  float sin_i = dot(T, L);
  float sin_o = dot(T, V);
  float cos_i = sin_from_cos(sin_i);
  float cos_o = sin_from_cos(sin_o);
  float theta_i = atan(sin_i, cos_i);
  float phi = relative_azimuth(T, L, V);

  float beta_f = mean(dual(4, theta_i));
  vec3 back = dual(6, theta_i) * (view.back_gain / PI);
  float back_shift = mean(dual(7, theta_i));
  float back_width = mean(dual(8, theta_i));
  float spread = count * beta_f * beta_f;
  // Variances of theta_h are quarters of those of theta_i + theta_o.
  float back_v = 4.0 * back_width * back_width;
  vec3 direct = hair_bsdf(T, L, V) + back * back_azimuth(phi) *
                shifted_lobe(sin_i, cos_i, sin_o, cos_o, 2.0 * back_shift, back_v);

  float v = variance_from_roughness(settings.roughness);
  float v_r = variance_from_roughness((1.0 - settings.coat) * settings.roughness);
  float tilt_trt = settings.shifts == 0 ? 4.0 : 3.0;
  float more = 4.0 * spread;
  vec4 m = vec4(shifted_lobe(sin_i, cos_i, sin_o, cos_o, -2.0 * settings.tilt, v_r + more),
                shifted_lobe(sin_i, cos_i, sin_o, cos_o, settings.tilt, max(0.25 * v, 1e-4) + more),
                shifted_lobe(sin_i, cos_i, sin_o, cos_o, tilt_trt * settings.tilt, 4.0 * v + more),
                d_eon_lobe(sin_i, cos_i, sin_o, cos_o, 4.0 * v + more));
  vec2 at = n_coordinates(phi, cos_o, settings.axes);
  vec4 n = textureLod(n_g_table, at, 0.0);
  vec3 n_trt = textureLod(n_g_trt_table, at, 0.0).rgb;
  vec3 n_res = textureLod(n_res_table, vec2(0.5, at.y), 0.0).rgb;
  vec3 through = m.x * vec3(n.a) + m.y * n.rgb + m.z * n_trt + m.w * n_res;
  vec3 back_spread = back * spread_back_azimuth(phi) *
                     shifted_lobe(sin_i, cos_i, sin_o, cos_o, 2.0 * back_shift, back_v + more);
  return direct_part(count) * direct + scattered_part(count, dual(0, theta_i)) * (through + back_spread);
}

vec3 hair_albedo()
{
  return view.hair_albedo.rgb;
}

#include "include/shade_strand.glsl"
