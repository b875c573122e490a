// SPDX-License-Identifier: GPL-3.0-or-later
// The energy-conserving model [DEon11] [Chiang16] among other strands [Zinke08], for models that define
//
// float fibre_roughness()               longitudinal
// FibreLobes fibre_lobes(vec2 at)       N, for light from one direction, at coordinates of `n_coordinates`
// FibreLobes forward_lobes(vec2 at)     N, for light that strands in front have scattered
// vec3 dual(float row, float theta_i)   scattering by the strands around; rows as in `dual_scattering.QUANTITIES`
//                                       and interpolated

#include "fibre/drawn_lobes.glsl"
#include "fibre/dual_scattering.glsl"
#include "fibre/marschner.glsl"

// Of a lobe [rad²]. White hair reflects so much that rounding may leave light from a point no spread at all.
const float LEAST_VARIANCE = 1e-4;

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

// `dual_scattering.radiance`. Widths and shifts are of the light of all channels.
vec3 hair_radiance(vec3 T, vec3 L, vec3 V, float front, float behind, float blur)
{
  float sin_i = dot(T, L);
  float sin_o = dot(T, V);
  float cos_i = sin_from_cos(sin_i);
  float cos_o = sin_from_cos(sin_o);
  float theta_i = atan(sin_i, cos_i);
  float theta_o = atan(sin_o, cos_o);
  float phi = relative_azimuth(T, L, V);

  vec3 onward, backward, kept, returned;
  vec3 a_f = dual(0.0, theta_i);
  vec3 a_b = dual(1.0, theta_i);
  float c_f = mean_cosine(dual(4.0, theta_i));
  float c_b = mean_cosine(dual(5.0, theta_i));
  fluxes(front, behind, a_f, a_b, onward, backward);
  fluxes(front, behind, c_f * a_f, c_b * a_b, kept, returned);
  vec3 direct = vec3(direct_part(front));
  float forward = total(a_f) / total(a_f + a_b);
  float cosine = mix(c_b, c_f, forward);
  float shift = 2.0 / 3.0 * total(dual(3.0 - forward, theta_i));
  vec2 through_drift = drift(kept - direct, onward - direct, 1.0, cosine, shift);
  vec2 back_drift = drift(returned, backward, cosine, cosine, shift);
  vec2 at = n_coordinates(phi, cos_o, settings.axes);
  float turned = theta_o - through_drift.x;
  vec3 through = lobe_sum(fibre_m(sin_i, sin(turned), through_drift.y + blur), forward_lobes(at));
  // Backscattered light is so wide that the lobes of this strand hardly matter.
  float back_m = shifted_lobe(sin_i, cos_i, sin_o, cos_o, back_drift.x, max(back_drift.y + blur, LEAST_VARIANCE));
  vec3 returning = back_m / PI * mix(a_b, a_f, back_azimuth(phi));
  return direct * hair_bsdf(T, L, V, blur) +
         drawn_lobes.w * ((onward - direct) * through + backward * returning);
}

// Uniform light that the strands behind reflect through a strand.
vec3 returned_from_behind(float sin_theta_o, float behind)
{
  float theta_o = atan(sin_theta_o, sin_from_cos(sin_theta_o));
  vec3 attenuation, reflectance, beyond, returned;
  deep_hair(dual(0.0, theta_o), dual(1.0, theta_o), attenuation, reflectance);
  layer_parts(behind, attenuation, reflectance, beyond, returned);
  return dual(0.0, theta_o) * returned;
}
