// SPDX-License-Identifier: GPL-3.0-or-later
// The energy-conserving Marschner model [DEon11] [Chiang16]: M is evaluated, N read from baked tables at theta_o.

#include "fibre/constants.glsl"
#include "fibre/lobe_sum.glsl"

float fibre_roughness()
{
  return settings.roughness;
}

vec3 fibre_residual(vec2 at)
{
  return textureLod(n_res_table, vec2(0.5, at.y), 0.0).rgb;
}

FibreLobes fibre_lobes(vec2 at)
{
  FibreLobes lobes;
  lobes.n = textureLod(n_table, at, 0.0);
  lobes.n_trt = textureLod(n_trt_table, at, 0.0).rgb;
  lobes.n_res = fibre_residual(at);
  return lobes;
}

FibreLobes forward_lobes(vec2 at)
{
  FibreLobes lobes;
  lobes.n = textureLod(n_g_table, at, 0.0);
  lobes.n_trt = textureLod(n_g_trt_table, at, 0.0).rgb;
  lobes.n_res = fibre_residual(at);
  return lobes;
}

vec3 dual(float row, float theta_i)
{
  return textureLod(dual_table, vec2(theta_i / PI + 0.5, (row + 0.5) / 9.0), 0.0).rgb;
}

#include "fibre/dual_radiance.glsl"
#include "fibre/ambient_response.glsl"
#include "fibre/shade_strand.glsl"
