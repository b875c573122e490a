// SPDX-License-Identifier: GPL-3.0-or-later
// Parts of a sample that strands cover in front of surfaces: one bit in `covered` for each of 16 parallel lines through the
// sample, along rows for flat segments and along columns for steep ones. Replaces visibility/uncounted.glsl.

const float LINES = 16.0;  // half of the bits

// Adds a segment in a column of samples: it covers rows from `rows.x` to `rows.y`, without jitter.
void count_part(bool is_steep, int column, int last_row, vec2 rows, float along)
{
  vec2 nearest = end_depths - end_rises;  // of the side that faces the viewer, as the axis may lie in the surface
  float depth = mix(nearest.x, nearest.y, clamp(along, 0.0, 1.0));
  int row = max(int(floor(rows.x)), 0);
  int last = min(int(floor(rows.y)), last_row);
  for (; row <= last; row++) {
    uvec2 lines = uvec2(clamp(rows - float(row), vec2(0.0), vec2(1.0)) * LINES + 0.5);
    uint bits = ((1u << lines.y) - (1u << lines.x)) << (is_steep ? 16u : 0u);
    ivec2 place = is_steep ? ivec2(row, column) : ivec2(column, row);
    // Most samples are covered already: reading first is cheaper than writing.
    if ((bits & ~imageLoad(covered, place).r) != 0u && depth <= texelFetch(surface_depth, place, 0).r) {
      imageAtomicOr(covered, place, bits);
    }
  }
}

// Adds a whole sample after `meet`, if strands are in front: elsewhere `depths` has the depth of the surface.
void count_all(ivec2 place)
{
  if (uintBitsToFloat(imageLoad(depths, place).r) < texelFetch(surface_depth, place, 0).r) {
    imageAtomicOr(covered, place, 0xFFFFFFFFu);
  }
}
