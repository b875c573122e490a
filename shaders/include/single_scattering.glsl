// SPDX-License-Identifier: GPL-3.0-or-later
// For models without multiple scattering: light is attenuated by strands, and keeps its direction.

#include "include/opacity.glsl"

vec3 hair_radiance(vec3 T, vec3 L, vec3 V, float count, float blur)
{
  return transmitted(count, view.hair_forward.rgb) * hair_bsdf(T, L, V, blur);
}
