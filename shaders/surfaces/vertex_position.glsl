// SPDX-License-Identifier: GPL-3.0-or-later

#include "strands/strip.glsl"

// The position or normal of a vertex, from a texture with three consecutive texels per vertex.
vec3 vertex_place(sampler2D places, int index)
{
  ivec2 texel = strand_texel(index, 0, 3, textureSize(places, 0).x / 3);
  return vec3(texelFetch(places, texel, 0).r,
              texelFetch(places, texel + ivec2(1, 0), 0).r,
              texelFetch(places, texel + ivec2(2, 0), 0).r);
}
