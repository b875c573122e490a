// SPDX-License-Identifier: GPL-3.0-or-later
// After shadows/shadow_rows.comp: texels without strands get the nearest front and the farthest back around them, so that
// both can be interpolated. Maps that are drawn together are stacked in `fronts` and `backs`.

#include "shadows/opacity.glsl"

void main()
{
  ivec2 here = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(here, textureSize(fronts, 0)))) {
    return;
  }
  int size = textureSize(fronts, 0).x;
  int turn = here.y / size;
  int first = turn * size;
  int last = first + size - 1;
  int layer = shadow_views.view[turn].light_index;
  if (layer < 0) {
    return;
  }
  vec2 ends = vec2(front_of_bits(texelFetch(fronts, here, 0).r), front_of_bits(texelFetch(backs, here, 0).r));
  if (ends.x >= FAR) {
    for (int y = max(here.y - FILL_REACH, first); y <= min(here.y + FILL_REACH, last); y++) {
      vec2 near = texelFetch(row_ends, ivec2(here.x, y), 0).rg;
      ends = vec2(min(ends.x, near.x), max(ends.y, near.y));
    }
  }
  imageStore(filtered, ivec3(here.x, here.y - first, layer), vec4(ends, 0.0, 0.0));
}
