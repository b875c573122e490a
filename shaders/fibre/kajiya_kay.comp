// SPDX-License-Identifier: GPL-3.0-or-later
// The Kajiya-Kay model [Kajiya89], [Report12] Eq. 13.

#include "fibre/drawn_lobes.glsl"
#include "fibre/kajiya_kay.glsl"
#include "fibre/light_highlight.glsl"

vec3 hair_bsdf(vec3 T, vec3 L, vec3 V, float blur)
{
  // The integral of sin(T, L) over the sphere is pi², so this diffuse part has the albedo diffuse_color.
  vec3 diffuse = settings.diffuse_color * kajiya_kay_diffuse(T, L) / (PI * PI);
  float exponent = blurred_exponent(settings.exponent, blur);
  float peak = kajiya_kay_specular_albedo(settings.exponent) / kajiya_kay_specular_albedo(exponent);
  vec3 specular = settings.specular_color * (peak * kajiya_kay_specular(T, L, V, exponent));
  return drawn_lobes.w * diffuse + drawn_lobes.x * light_highlight * specular;
}

void hair_return(float sin_theta_o, out vec3 returned, out vec3 towards, out vec3 zonal_1, out vec3 zonal_2)
{
  vec3 specular = settings.specular_color * kajiya_kay_specular_albedo(settings.exponent);
  returned = settings.diffuse_color + specular;
  kajiya_kay_zonal(settings.diffuse_color, specular, sin_theta_o, zonal_1, zonal_2);
  towards = vec3(0.0);
}

#include "fibre/single_scattering.glsl"
#include "fibre/shade_strand.glsl"
