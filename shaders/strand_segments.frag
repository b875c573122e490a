// SPDX-License-Identifier: GPL-3.0-or-later
// Visibility buffer of strands drawn as strips: segment index and depth.

#include "include/coverage.glsl"

void main()
{
  ivec2 place = ivec2(gl_FragCoord.xy) + ivec2(view.first_column, view.first_row);
  if (!is_covered(strand_offset(strand_index) + view.coverage_turn, place, strand_coverage)) {
    discard;
  }
  int pieces = view.drawn_points - 1;
  int piece = clamp(int(strand_place), 0, pieces - 1);
  segment = uint(first_segment + strand_index * pieces + piece);
  depth = floatBitsToUint(gl_FragCoord.z);
}
