// SPDX-License-Identifier: GPL-3.0-or-later
// For models without multiple scattering: strands attenuate light without changing its direction.

#include "shadows/opacity.glsl"

vec3 hair_radiance(vec3 T, vec3 L, vec3 V, float front, float behind, float blur)
{
  return transmitted(front, view.hair_forward.rgb) * hair_bsdf(T, L, V, blur);
}

vec3 returned_from_behind(float sin_theta_o, float behind)
{
  return vec3(0.0);
}
