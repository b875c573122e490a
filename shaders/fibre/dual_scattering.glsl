// SPDX-License-Identifier: GPL-3.0-or-later
// Dual scattering [Zinke08]: forward scattering by strands in front, backscattering by strands behind; fluxes between them
// by [Kubelka31].

#include "fibre/longitudinal.glsl"

// Minimum attenuation by a strand, and maximum reflectance of deep hair: without loss, fluxes would not fall exponentially.
const float LEAST_ATTENUATION = 1e-3;
const float MOST_REFLECTANCE = 0.995;

// Minimum mean cosine, for light from everywhere; and minimum flux, without light.
const float LEAST_COSINE = 1e-3;
const float LEAST_FLUX = 1e-6;

// Fraction of the light from the half circle behind that goes to the front, by the azimuth |phi| of the front.
float back_azimuth(float phi)
{
  return 1.0 - phi / PI;
}

// Unscattered fraction of light behind a mean of `count` strands.
float direct_part(float count)
{
  return exp(-count);
}

// Attenuation by each strand of infinitely many, and reflectance of all strands together.
void deep_hair(vec3 a_f, vec3 a_b, out vec3 attenuation, out vec3 reflectance)
{
  vec3 lost = vec3(1.0) - a_f;
  attenuation = sqrt(max(lost * lost - a_b * a_b, vec3(LEAST_ATTENUATION * LEAST_ATTENUATION)));
  reflectance = min(a_b / (lost + attenuation), vec3(MOST_REFLECTANCE));
}

// Fractions of light that a mean of `count` strands of `deep_hair` transmits and reflects.
void layer_parts(float count, vec3 attenuation, vec3 reflectance, out vec3 transmitted_part, out vec3 reflected_part)
{
  vec3 left = exp(-attenuation * count);
  vec3 turned = reflectance * reflectance;
  vec3 kept = vec3(1.0) - turned * left * left;
  transmitted_part = (vec3(1.0) - turned) * left / kept;
  reflected_part = reflectance * (vec3(1.0) - left * left) / kept;
}

// Light at a strand between means of `front` and `behind` others, as fractions of incident light: onward from the front,
// backward from behind.
void fluxes(float front, float behind, vec3 a_f, vec3 a_b, out vec3 onward, out vec3 backward)
{
  vec3 attenuation, reflectance, through, reflected, beyond, returned;
  deep_hair(a_f, a_b, attenuation, reflectance);
  layer_parts(front, attenuation, reflectance, through, reflected);
  layer_parts(behind, attenuation, reflectance, beyond, returned);
  onward = through / (vec3(1.0) - reflected * returned);
  backward = onward * returned;
}

float total(vec3 rgb)
{
  return rgb.r + rgb.g + rgb.b;
}

// Factor by which scattering of these widths of theta_h shrinks the mean sine of the inclination.
float mean_cosine(vec3 width)
{
  float variance = 4.0 / 3.0 * dot(width, width);
  float opposite = exp(-2.0 / variance);
  return (1.0 + opposite) / (1.0 - opposite) - variance;
}

// Shift and variance, in theta_i + theta_o, of light with a flux whose mean sine is `kept`, if each event multiplies the
// mean sine by `cosine` and shifts light by `shift`; last: factor of one more event. `dual_scattering.drifts`.
vec2 drift(vec3 kept, vec3 flux, float last, float cosine, float shift)
{
  float m = clamp(last * (total(kept) + LEAST_FLUX) / (total(flux) + LEAST_FLUX), LEAST_COSINE, 1.0);
  float turned = shift * log(m) / log(cosine);
  float variance = (1.0 - m * m) / (m * (3.0 - m * m));  // Banerjee et al. 2005
  return vec2(turned, variance + turned * turned);
}
