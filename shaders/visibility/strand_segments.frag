// SPDX-License-Identifier: GPL-3.0-or-later
// Visibility buffer of strands drawn as strips: segment index, and depth of the round side as in
// visibility/strand_segments.comp.

#include "visibility/coverage.glsl"
#include "visibility/unclipped.glsl"

void main()
{
  vec2 place = gl_FragCoord.xy + vec2(view.first_column, view.first_row);
  // As in visibility/rasterize_segment.glsl: samples are jittered along the axis on which the strand is shorter.
  vec2 across = vec2(dFdx(strand_side_place), dFdy(strand_side_place));
  bool is_steep = abs(across.x) > abs(across.y);
  float slope = is_steep ? across.x : across.y;
  place = is_steep ? place.yx : place;
  float middle = place.y - strand_side_place / ((slope == 0.0) ? 1.0 : slope);
  float offset = strand_offset_part * sample_offset(int(place.x), middle, offset_turn(view.coverage_turn));
  float side = strand_side_place + offset * slope;
  if (strand_offset_part > 0.0 && abs(side) >= strand_coverage) {
    discard;
  }
  if (IS_CLIPPED && is_cut_off(drawn_position)) {
    discard;
  }
  int pieces = view.drawn_points - 1;
  int piece = clamp(int(strand_place), 0, pieces - 1);
  segment = uint(view.first_segment + strand_index * pieces + piece);
  float part = clamp(side / max(strand_coverage, 1e-6), -1.0, 1.0);
  gl_FragDepth = max(gl_FragCoord.z - strand_rise * sqrt(1.0 - part * part), 0.0);
  depth = floatBitsToUint(gl_FragDepth);
}
