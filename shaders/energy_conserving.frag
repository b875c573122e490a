// SPDX-License-Identifier: GPL-3.0-or-later
// The energy-conserving Marschner model [DEon11] [Chiang16]: M evaluated, N from baked tables at theta_o.

#include "include/longitudinal.glsl"
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

vec3 hair_albedo()
{
  return view.hair_albedo.rgb;
}

#include "include/shade_strand.glsl"
