// SPDX-License-Identifier: GPL-3.0-or-later
// The farthest of the nearest depths in each tile of a picture: anything beyond it is occluded [Greene93].

#include "visibility/tile.glsl"

void main()
{
  ivec2 tile = ivec2(gl_GlobalInvocationID.xy);
  ivec2 size = textureSize(depths, 0);
  ivec2 first = tile * TILE;
  if (any(greaterThanEqual(first, size))) {
    return;
  }
  ivec2 end = min(first + TILE, size);
  uint farthest = 0u;
  for (int y = first.y; y < end.y; y++) {
    for (int x = first.x; x < end.x; x++) {
      farthest = max(farthest, texelFetch(depths, ivec2(x, y), 0).r);
    }
  }
  imageStore(farthest_depths, tile, uvec4(farthest));
}
