// SPDX-License-Identifier: GPL-3.0-or-later
// N for the absorption at this sample: needs the samplers n_slices and return_slices and the block slices.

#include "fibre/absorption_slices.glsl"
#include "fibre/fibre.glsl"
#include "fibre/lobe_sum.glsl"
#include "fibre/one_layer.glsl"
#include "fibre/varied_strand.glsl"

vec4 layer_lobes(vec2 at, float sigma_a, float layer)
{
  float texel_count = float(textureSize(n_slices, 0).z);
  float slice_count = texel_count / layer_count();
  vec2 place = slice_of(sigma_a, slices.low, slices.high, int(slice_count));
  float first = place.x + slice_count * layer;
  vec4 below = textureLod(n_slices, vec3(at, (first + 0.5) / texel_count), 0.0);
  vec4 above = textureLod(n_slices, vec3(at, (first + 1.5) / texel_count), 0.0);
  return geometric_mix(below, above, place.y);
}

// N_TT, N_TRT, N of the residual and N_R for one channel's absorption.
vec4 channel_lobes(vec2 at, float sigma_a)
{
  vec2 layer = this_layer();
  vec4 lobes = layer_lobes(at, sigma_a, layer.x);
  return HAS_LAYERS ? mix(lobes, layer_lobes(at, sigma_a, layer.x + 1.0), layer.y) : lobes;
}

FibreLobes side_by_side(vec4 red, vec4 green, vec4 blue)
{
  FibreLobes lobes;
  lobes.n = vec4(red.x, green.x, blue.x, red.w);
  lobes.n_trt = vec3(red.y, green.y, blue.y);
  lobes.n_res = vec3(red.z, green.z, blue.z);
  return lobes;
}

FibreLobes fibre_lobes(vec2 at)
{
  vec3 sigma_a = this_sigma_a();
  return side_by_side(channel_lobes(at, sigma_a.r), channel_lobes(at, sigma_a.g), channel_lobes(at, sigma_a.b));
}

// A value in [0, 1] → the coordinate in a table whose first and last texel centers are at 0 and 1.
float between_ends(float value, float texel_count)
{
  return (clamp(value, 0.0, 1.0) * (texel_count - 1.0) + 0.5) / texel_count;
}

// The coordinate in a table with one part for each layer, for a value in [0, 1] along the part of a layer.
float within_layer(float value, float texel_count, float layer)
{
  return (between_ends(value, texel_count / layer_count()) + layer) / layer_count();
}

// Response to uniform light towards theta_o for one channel's absorption: the integral over phi, the integral weighted with
// the cosine of phi, and the responses to P1 and P2 of sin(theta_i). Same as `albedo.fibre_moments`.
vec4 channel_return(float u, float sigma_a)
{
  float along = (sqrt(sigma_a) - slices.low) / max(slices.high - slices.low, 1e-6);
  float texel_count = float(textureSize(return_slices, 0).y);
  vec2 layer = this_layer();
  vec4 found = textureLod(return_slices, vec2(u, within_layer(along, texel_count, layer.x)), 0.0);
  if (!HAS_LAYERS) {
    return found;
  }
  vec4 next = textureLod(return_slices, vec2(u, within_layer(along, texel_count, layer.x + 1.0)), 0.0);
  return mix(found, next, layer.y);
}

void fibre_return(float sin_theta_o, out vec3 returned, out vec3 towards, out vec3 zonal_1, out vec3 zonal_2)
{
  float u = atan(sin_theta_o, sin_from_cos(sin_theta_o)) / PI + 0.5;
  vec3 sigma_a = this_sigma_a();
  vec4 red = channel_return(u, sigma_a.r);
  vec4 green = channel_return(u, sigma_a.g);
  vec4 blue = channel_return(u, sigma_a.b);
  returned = vec3(red.x, green.x, blue.x);
  towards = vec3(red.y, green.y, blue.y);
  zonal_1 = vec3(red.z, green.z, blue.z);
  zonal_2 = vec3(red.w, green.w, blue.w);
}
