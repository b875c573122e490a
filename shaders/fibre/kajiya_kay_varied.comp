// SPDX-License-Identifier: GPL-3.0-or-later
// The Kajiya-Kay model [Kajiya89] for varied strands: color and highlight follow from absorption and roughness.

#include "fibre/drawn_lobes.glsl"
#include "fibre/kajiya_kay.glsl"
#include "fibre/light_highlight.glsl"
#include "fibre/look_falloff.glsl"
#include "fibre/varied_strand.glsl"

float this_exponent()
{
  return highlight_exponent((1.0 - settings.coat) * this_roughness());
}

vec3 hair_bsdf(vec3 T, vec3 L, vec3 V, float blur)
{
  float exponent = blurred_exponent(this_exponent(), blur);
  float specular = highlight_peak(settings.reflectance, exponent) * kajiya_kay_specular(T, L, V, exponent);
  // The integral of sin(T, L) over the sphere is pi², so this diffuse part has the albedo of the color.
  vec3 diffuse = color_from_falloff(this_sigma_a(), this_falloff()) * kajiya_kay_diffuse(T, L) / (PI * PI);
  return drawn_lobes.w * diffuse + drawn_lobes.x * light_highlight * vec3(specular);
}

void hair_return(float sin_theta_o, out vec3 returned, out vec3 towards, out vec3 zonal_1, out vec3 zonal_2)
{
  float exponent = this_exponent();
  float specular = highlight_peak(settings.reflectance, exponent) * kajiya_kay_specular_albedo(exponent);
  vec3 diffuse = color_from_falloff(this_sigma_a(), this_falloff());
  returned = diffuse + vec3(specular);
  kajiya_kay_zonal(diffuse, vec3(specular), sin_theta_o, zonal_1, zonal_2);
  towards = vec3(0.0);
}

#include "fibre/single_scattering.glsl"
#include "fibre/shade_strand.glsl"
