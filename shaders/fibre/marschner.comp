// SPDX-License-Identifier: GPL-3.0-or-later
// The Marschner model [Marschner03] from baked tables, [Report12] Eq. 14.

#include "fibre/drawn_lobes.glsl"
#include "fibre/fibre.glsl"
#include "fibre/light_highlight.glsl"
#include "fibre/marschner.glsl"

// M is baked for light from one direction: the size of lights is ignored.
vec3 hair_bsdf(vec3 T, vec3 L, vec3 V, float blur)
{
  float sin_theta_i = dot(T, L);
  float sin_theta_o = dot(T, V);
  // From the directions, as the table's alpha has errors of up to 0.014 near grazing.
  float cosine = cos_theta_d(sin_theta_i, sin_theta_o);
  vec2 n_at = n_coordinates(relative_azimuth(T, L, V), cosine, settings.axes);
  vec3 m = textureLod(m_table, m_coordinates(sin_theta_i, sin_theta_o, settings.axes), 0.0).rgb;
  m.x *= light_highlight.g;  // alike in all channels: only the energy-conserving model is tinted
  vec4 n = textureLod(n_table, n_at, 0.0);
  vec3 n_trt = textureLod(n_trt_table, n_at, 0.0).rgb;
  return marschner_scattering(drawn_lobes.xyz * m, n, n_trt, cosine) * sin_from_cos(sin_theta_i);
}

#include "fibre/ambient_response.glsl"

#include "fibre/single_scattering.glsl"
#include "fibre/shade_strand.glsl"
