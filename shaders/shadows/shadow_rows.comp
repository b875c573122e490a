// SPDX-License-Identifier: GPL-3.0-or-later
// Between the first and second pass of a shadow map: the nearest front and the farthest back of each texel and its neighbors
// in the row.

#include "shadows/opacity.glsl"

void main()
{
  ivec2 here = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(here, textureSize(fronts, 0)))) {
    return;
  }
  int last = textureSize(fronts, 0).x - 1;
  uint front = 0xFFFFFFFFu;
  uint back = 0u;
  for (int x = max(here.x - FILL_REACH, 0); x <= min(here.x + FILL_REACH, last); x++) {
    ivec2 place = ivec2(x, here.y);
    front = min(front, texelFetch(fronts, place, 0).r);
    back = max(back, texelFetch(backs, place, 0).r);
  }
  imageStore(filtered, here, vec4(front_of_bits(front), front_of_bits(back), 0.0, 0.0));
}
