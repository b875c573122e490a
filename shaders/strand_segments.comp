// SPDX-License-Identifier: GPL-3.0-or-later
// Visibility buffer of strands: first the depth of the nearest segment, then its index.

#include "include/coverage.glsl"
const bool FILLS_BENDS = true;

#include "include/walk_segment.glsl"

vec2 end_depths;
uint this_index;
float dash_offset;
ivec2 first_place;

void begin(int strand, int piece, Segment segment, vec4 first, vec4 second)
{
  end_depths = vec2(segment.start.z, segment.end.z);
  dash_offset = strand_offset(strand) + view.coverage_turn;
  first_place = ivec2(view.first_column, view.first_row);
  this_index = uint(first_segment + strand * (view.drawn_points - 1) + piece);
}

void meet(ivec2 place, float along, float coverage)
{
  if (!is_covered(dash_offset, place + first_place, coverage)) {
    return;
  }
  // The bits of non-negative floats sort like their values.
  uint depth = floatBitsToUint(max(mix(end_depths.x, end_depths.y, along), 0.0));
  uint nearest = imageLoad(depths, place).r;
  if (is_depth != 0) {
    // Most samples are occluded: reading first is cheaper than writing.
    if (depth < nearest) {
      imageAtomicMin(depths, place, depth);
    }
  }
  else if (depth == nearest) {
    imageAtomicMin(segments, place, this_index);  // the same one at each redraw
  }
}

void main()
{
  walk_run(imageSize(depths));
}
