// SPDX-License-Identifier: GPL-3.0-or-later
// Visibility buffer of strands: first the depth of the nearest segment (IS_DEPTH), then its index. Strands are round: the
// depth is of the side that faces the viewer. IS_ROUND: see visibility/rasterize_segment.glsl.

#include "visibility/segment.glsl"
#include "visibility/tile.glsl"

const int RUNS_IN_ROW = 16384;  // of `seen_runs`

vec2 end_depths;  // of the axis
vec2 end_rises;  // difference of depth to the side that faces the viewer
vec2 round_rises;  // the same for the spheres at the ends of a strand
uint this_index;
bool is_seen = false;

ivec2 run_texel(int run)
{
  int texel = first_run + run;
  return ivec2(texel & (RUNS_IN_ROW - 1), texel / RUNS_IN_ROW);
}

// Only runs whose depths were the least when they were written can have indices: one in many.
bool is_left_out(int run)
{
  return !IS_DEPTH && imageLoad(seen_runs, run_texel(run)).r == 0u;
}

void end_run(int run)
{
  if (IS_DEPTH) {
    imageStore(seen_runs, run_texel(run), uvec4(is_seen ? 1u : 0u));
  }
}

void begin(int strand, int piece, Segment segment, vec4 first, vec4 second)
{
  end_depths = vec2(segment.start.z, segment.end.z);
  end_rises = depth_rises(segment, distance(first.xyz, second.xyz));
  round_rises = segment.half_width / segment.w * view.depth_rise;
  this_index = uint(view.first_segment + strand * (view.drawn_points - 1) + piece);
}

// Whether all samples in the tiles have nearer depths. Depths are linear along a segment, except for rounding.
bool is_hidden(ivec2 low, ivec2 high, float first_along, float last_along)
{
  if (are_tiles_known == 0) {
    return false;
  }
  vec2 alongs = clamp(vec2(first_along, last_along), vec2(0.0), vec2(1.0));
  vec2 ends = mix(end_depths.xx, end_depths.yy, alongs);
  float rise = max(end_rises.x, end_rises.y);
  uint nearest = floatBitsToUint(max(min(ends.x, ends.y) - rise - 1e-6, 0.0));
  for (int y = low.y / TILE; y <= high.y / TILE; y++) {
    for (int x = low.x / TILE; x <= high.x / TILE; x++) {
      if (nearest <= texelFetch(farthest_depths, ivec2(x, y), 0).r) {
        return false;
      }
    }
  }
  return true;
}

void meet(ivec2 place, float along, float across, float coverage)
{
  // The bits of nonnegative floats have the order of the floats.
  float within = clamp(along, 0.0, 1.0);
  vec2 rises = (within == along) ? end_rises : round_rises;
  float rise = mix(rises.x, rises.y, within) * sqrt(max(1.0 - across * across, 0.0));
  uint depth = floatBitsToUint(max(mix(end_depths.x, end_depths.y, within) - rise, 0.0));
  uint nearest = imageLoad(depths, place).r;
  // The second condition is always true, but unknown at compile time: without it NVIDIA's compiler makes the program a sixth
  // slower.
  if (IS_DEPTH && are_tiles_known >= 0) {
    is_seen = is_seen || depth <= nearest;
    // Most samples are occluded: reading first is cheaper than writing.
    if (depth < nearest) {
      imageAtomicMin(depths, place, depth);
    }
  }
  else if (depth == nearest) {
    imageAtomicMin(segments, place, this_index);  // the same index at each redraw
  }
}

const bool HAS_TILES = true;

#include "visibility/rasterize_segment.glsl"

void main()
{
  walk_run(imageSize(depths));
}
