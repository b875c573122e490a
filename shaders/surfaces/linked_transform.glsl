// SPDX-License-Identifier: GPL-3.0-or-later
// Transforms of linked surfaces, which are drawn as instances: needs the sampler transforms.

#include "strands/strip.glsl"

// Object to world of an instance.
mat4 linked_transform(int index)
{
  ivec2 texel = strand_texel(index, 0, 4, textureSize(transforms, 0).x / 4);
  return mat4(texelFetch(transforms, texel, 0),
              texelFetch(transforms, texel + ivec2(1, 0), 0),
              texelFetch(transforms, texel + ivec2(2, 0), 0),
              texelFetch(transforms, texel + ivec2(3, 0), 0));
}
