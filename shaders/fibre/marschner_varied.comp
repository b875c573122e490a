// SPDX-License-Identifier: GPL-3.0-or-later
// The Marschner model [Marschner03] for strands that differ in absorption and roughness.

#include "fibre/lobe_sum.glsl"

vec3 inner_reflection(vec2 at, FibreLobes lobes, vec3 T, vec3 L, vec3 V)
{
  return lobes.n_trt;
}

#include "fibre/gaussian_bsdf.glsl"
#include "fibre/single_scattering.glsl"
#include "fibre/shade_strand.glsl"
