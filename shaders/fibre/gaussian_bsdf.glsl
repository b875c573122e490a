// SPDX-License-Identifier: GPL-3.0-or-later
// The Marschner model [Marschner03] with M evaluated, for models that define
//
// vec3 inner_reflection(vec2 at, FibreLobes lobes, vec3 T, vec3 L, vec3 V)   N_TRT

#include "fibre/drawn_lobes.glsl"
#include "fibre/fibre.glsl"
#include "fibre/light_highlight.glsl"
#include "fibre/marschner.glsl"
#include "fibre/varied_fibre.glsl"

vec3 hair_bsdf(vec3 T, vec3 L, vec3 V, float blur)
{
  float sin_theta_i = dot(T, L);
  float sin_theta_o = dot(T, V);
  float cos_theta_i = sin_from_cos(sin_theta_i);
  float cosine = cos_theta_d(sin_theta_i, sin_theta_o);
  vec2 at = n_coordinates(relative_azimuth(T, L, V), cosine, settings.axes);
  FibreLobes lobes = fibre_lobes(at);
  float theta_h = 0.5 * (atan(sin_theta_i, cos_theta_i) + atan(sin_theta_o, sin_from_cos(sin_theta_o)));
  float tilt_trt = settings.shifts == 0 ? 2.0 : 1.5;
  vec3 m = gaussian_lobes(theta_h, settings.tilt, tilt_trt, beta_r_of(this_roughness()), blur);
  m.x *= light_highlight.g;  // alike in all channels: only the energy-conserving model is tinted
  return marschner_scattering(drawn_lobes.xyz * m, lobes.n, inner_reflection(at, lobes, T, L, V), cosine) * cos_theta_i;
}

void hair_return(float sin_theta_o, out vec3 returned, out vec3 towards, out vec3 zonal_1, out vec3 zonal_2)
{
  fibre_return(sin_theta_o, returned, towards, zonal_1, zonal_2);
}
