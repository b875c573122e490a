// SPDX-License-Identifier: GPL-3.0-or-later
// The Marschner model [Marschner03] for varied strands with an elliptic section, rotated differently in each strand.

#include "fibre/elliptic_section.glsl"
#include "fibre/varied_fibre.glsl"

float channel_inner_reflection(vec2 at, float sigma_a, vec4 weights)
{
  float slice_count = float(textureSize(n_trt_slices, 0).z);
  vec2 place = slice_of(sigma_a, slices.low, slices.high, int(slice_count));
  vec4 below = textureLod(n_trt_slices, vec3(at, (place.x + 0.5) / slice_count), 0.0);
  vec4 above = textureLod(n_trt_slices, vec3(at, (place.x + 1.5) / slice_count), 0.0);
  return dot(weights, geometric_mix(below, above, place.y));
}

vec3 inner_reflection(vec2 at, FibreLobes lobes, vec3 T, vec3 L, vec3 V)
{
  vec4 weights = layer_weights(cos_twice_phi_h(T, major_axis(T, this_random()), L, V));
  vec3 sigma_a = this_sigma_a();
  return vec3(channel_inner_reflection(at, sigma_a.r, weights),
              channel_inner_reflection(at, sigma_a.g, weights),
              channel_inner_reflection(at, sigma_a.b, weights));
}

#include "fibre/gaussian_bsdf.glsl"
#include "fibre/single_scattering.glsl"
#include "fibre/shade_strand.glsl"
