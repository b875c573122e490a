// SPDX-License-Identifier: GPL-3.0-or-later
// The energy-conserving Marschner model for strands that differ in absorption and roughness.

#include "fibre/varied_fibre.glsl"

float fibre_roughness()
{
  return this_roughness();
}

vec4 forward_layer(vec2 at, float sigma_a, float layer)
{
  float texel_count = float(textureSize(n_g_slices, 0).z);
  float slice_count = texel_count / layer_count();
  vec2 place = slice_of(sigma_a, slices.low, slices.high, int(slice_count));
  float first = place.x + slice_count * layer;
  vec4 below = textureLod(n_g_slices, vec3(at, (first + 0.5) / texel_count), 0.0);
  vec4 above = textureLod(n_g_slices, vec3(at, (first + 1.5) / texel_count), 0.0);
  return geometric_mix(below, above, place.y);
}

vec4 forward_channel(vec2 at, float sigma_a)
{
  vec2 layer = this_layer();
  vec4 lobes = forward_layer(at, sigma_a, layer.x);
  return HAS_LAYERS ? mix(lobes, forward_layer(at, sigma_a, layer.x + 1.0), layer.y) : lobes;
}

FibreLobes forward_lobes(vec2 at)
{
  vec3 sigma_a = this_sigma_a();
  return side_by_side(forward_channel(at, sigma_a.r),
                      forward_channel(at, sigma_a.g),
                      forward_channel(at, sigma_a.b));
}

#include "fibre/dual_along.glsl"

void hair_return(float sin_theta_o, out vec3 returned, out vec3 towards, out vec3 zonal_1, out vec3 zonal_2)
{
  fibre_return(sin_theta_o, returned, towards, zonal_1, zonal_2);
}

#include "fibre/dual_radiance.glsl"
#include "fibre/shade_strand.glsl"
