// SPDX-License-Identifier: GPL-3.0-or-later
// Rasterization of strands, one thread for each run of segments. Hair consists of lines about a sample wide, for which this
// is faster than triangles: GPUs draw triangles in blocks of four samples, and software drivers are slower still.

#include "strands/run_group.glsl"
#include "visibility/coverage.glsl"
#include "visibility/segment.glsl"
#include "visibility/tile.glsl"
#include "visibility/unclipped.glsl"
#include "visibility/uncounted.glsl"

// Compile-time constants of a program, as software drivers execute all branches:
//
// IS_ROUND
//     bends are filled and wide ends are drawn as disks; otherwise strands cover their length times their width, extended at
//     both ends by the area of half a disk
// HAS_TILES
//     tiles may be occluded, and samples may be jittered

// Most consecutive segments per thread: their points are read and projected once.
const int RUN_LENGTH = 8;

// Minimum half width [samples] for filled bends and disks at ends: those of thinner strands are smaller than a sample.
const float LEAST_BEND = 1.0;

// Functions that a program defines before it includes this:
//
// bool is_left_out(int run), void end_run(int run)
//     whether to skip a run of segments; called after a run. Runs are numbered in drawing order of all drawn strands, also if
//     only a part of them is rasterized
// void begin(int strand, int piece, Segment segment, vec4 first, vec4 second)
//     called at the start of a segment
// bool is_hidden(ivec2 low, ivec2 high, float first_along, float last_along)
//     whether to skip the samples from `low` to `high`, of a part between two parameters along the segment
// void meet(ivec2 place, float along, float across, float coverage)
//     called for a covered sample: its parameter along the segment, outside of [0, 1] in a round end; its offset from the
//     axis as a fraction of the drawn half width, and the strand's coverage of the drawn width
//
// visibility/uncounted.glsl has two more, for parts of samples.

// The first sample, counted from -1, whose center is beyond a position.
int first_sample(float place)
{
  return int(ceil(clamp(place, -1.0, 1e6) - 0.5));
}

// Extension of a segment beyond its start and end [samples], with the area of the half disks of its round ends. The wide end
// of a cone that points at the viewer is more than half a disk.
vec2 end_lengths(Segment segment)
{
  float narrowing = segment.half_width.x - segment.half_width.y;
  float angle = asin(clamp(narrowing / max(distance(segment.start.xy, segment.end.xy), 1e-6), -1.0, 1.0));
  float more = 0.5 * angle - 0.5 * tan(0.5 * angle);
  return segment.half_width * max(FOURTH_OF_PI + vec2(more, -more), vec2(0.0));
}

// Visits the samples in a segment, column by column along the axis on which it is longer. Samples may be jittered along the
// columns. beyond_ends: from `end_lengths`, zero at ends that join other segments.
void walk(Segment segment, vec2 beyond_ends, ivec2 size)
{
  vec2 extent = abs(segment.end.xy - segment.start.xy);
  bool is_steep = extent.y > extent.x;
  vec2 start = is_steep ? segment.start.yx : segment.start.xy;
  vec2 end = is_steep ? segment.end.yx : segment.end.xy;
  vec2 way = end - start;
  vec2 columns = vec2(start.x, end.x);
  if (beyond_ends != vec2(0.0)) {
    way.x = (abs(way.x) < 1e-4) ? 1e-4 : way.x;  // for a segment that points at the viewer
    columns += vec2(-1.0, 1.0) * beyond_ends * way.x / length(way);
  }
  ivec2 last_place = (is_steep ? size.yx : size) - 1;
  int first_column = max(first_sample(min(columns.x, columns.y)), 0);
  int last_column = min(first_sample(max(columns.x, columns.y)) - 1, last_place.x);
  if (last_column < first_column) {
    return;
  }
  float slope = way.y / way.x;
  float per_column = 1.0 / way.x;
  // Factor from the strand's width across its axis to its width along the columns.
  float widening = sqrt(1.0 + slope * slope);
  float least_half_width = view.least_half_width * view.pixels_per_unit;
  float most_reach = max(max(segment.half_width.x, segment.half_width.y), least_half_width) * widening;
  ivec2 first_place = is_steep ? ivec2(view.first_row, view.first_column) : ivec2(view.first_column, view.first_row);
  uint turn = offset_turn(view.coverage_turn);
  int column = first_column;
  float beyond = float(first_column) + 0.5 - start.x;  // the column's center from the start
  while (column <= last_column) {
    // Up to the end of the tile.
    int end_column = HAS_TILES ? min((column & ~(TILE - 1)) + TILE - 1, last_column) : last_column;
    float end_beyond = beyond + float(end_column - column);
    vec2 rows = start.y + vec2(beyond, end_beyond) * slope;
    ivec2 low = ivec2(column, max(first_sample(min(rows.x, rows.y) - most_reach - 0.5), 0));
    ivec2 high = ivec2(end_column, min(first_sample(max(rows.x, rows.y) + most_reach + 0.5), last_place.y));
    vec2 alongs = vec2(beyond, end_beyond) * per_column;
    if (high.y < low.y || is_hidden(is_steep ? low.yx : low, is_steep ? high.yx : high, alongs.x, alongs.y)) {
      column = end_column + 1;
      beyond = end_beyond + 1.0;
      continue;
    }
    for (; column <= end_column; column++) {
      float along = beyond * per_column;
      float true_half_width = mix(segment.half_width.x, segment.half_width.y, clamp(along, 0.0, 1.0));
      float half_width = max(true_half_width, least_half_width);
      float middle = start.y + beyond * slope;
      float reach = half_width * widening;
      count_part(is_steep, column, last_place.y, vec2(middle - reach, middle + reach), along);
      float offset_part = HAS_TILES ? view.sample_offset * offset_share(true_half_width) : 0.0;
      if (HAS_TILES && offset_part > 0.0) {
        middle -= offset_part * sample_offset(first_place.x + column, float(first_place.y) + middle, turn);
      }
      int first_row = max(first_sample(middle - reach), 0);
      int last_row = min(first_sample(middle + reach) - 1, last_place.y);
      for (int row = first_row; row <= last_row; row++) {
        float across = (float(row) + 0.5 - middle) / reach;
        meet(is_steep ? ivec2(row, column) : ivec2(column, row), along, across, true_half_width / half_width);
      }
      beyond += 1.0;
    }
  }
}

// Visits samples on the outside of a bend, which neither a segment nor the next covers in `walk`. start, end, next: positions
// of their points [samples]; half_width: at the end.
void fill_bend(vec2 start, vec2 end, vec2 next, float half_width, ivec2 size)
{
  vec2 before = end - start;
  vec2 after = next - end;
  bool was_steep = abs(before.y) > abs(before.x);
  bool is_steep = abs(after.y) > abs(after.x);
  float left = was_steep ? before.y : before.x;
  float right = is_steep ? after.y : after.x;
  // Segments that are cut off along the same axis and continue in the same direction leave no gap.
  if (half_width < LEAST_BEND || (was_steep == is_steep && left * right > 0.0)) {
    return;
  }
  ivec2 low = max(ivec2(first_sample(end.x - half_width), first_sample(end.y - half_width)), ivec2(0));
  ivec2 high = min(ivec2(first_sample(end.x + half_width), first_sample(end.y + half_width)), size) - 1;
  for (int row = low.y; row <= high.y; row++) {
    for (int column = low.x; column <= high.x; column++) {
      vec2 way = vec2(column, row) + 0.5 - end;
      bool is_beyond = (was_steep ? way.y : way.x) * left > 0.0;
      bool is_ahead = (is_steep ? way.y : way.x) * right < 0.0;
      if (is_beyond && is_ahead && dot(way, way) < half_width * half_width) {
        meet(ivec2(column, row), 1.0, length(way) / half_width, 1.0);
        count_all(ivec2(column, row));
      }
    }
  }
}

// Visits samples of the disk at the end of a strand; along: outside of [0, 1].
void fill_end(vec2 end, float half_width, float along, ivec2 size)
{
  ivec2 low = max(ivec2(first_sample(end.x - half_width), first_sample(end.y - half_width)), ivec2(0));
  ivec2 high = min(ivec2(first_sample(end.x + half_width), first_sample(end.y + half_width)), size) - 1;
  for (int row = low.y; row <= high.y; row++) {
    for (int column = low.x; column <= high.x; column++) {
      float away = distance(vec2(column, row) + 0.5, end) / half_width;
      if (away < 1.0) {
        meet(ivec2(column, row), along, away, 1.0);
        count_all(ivec2(column, row));
      }
    }
  }
}

// Visits the samples of a segment, including the ends of a strand.
void walk_to_ends(Segment segment, bvec2 are_ends, ivec2 size)
{
  vec2 beyond_ends = vec2(0.0);
  if (are_ends.x || are_ends.y) {
    beyond_ends = end_lengths(segment) * end_share() * vec2(are_ends);
    bvec2 are_wide = greaterThanEqual(segment.half_width, vec2(IS_ROUND ? LEAST_BEND : 1e9));
    beyond_ends *= vec2(not(are_wide));
    if (are_ends.x && are_wide.x) {
      fill_end(segment.start.xy, segment.half_width.x, -1.0, size);
    }
    if (are_ends.y && are_wide.y) {
      fill_end(segment.end.xy, segment.half_width.y, 2.0, size);
    }
  }
  walk(segment, beyond_ends, size);
}

// Index in drawing order of a rasterized strand; one in FIRST_SHARE strands comes before the others.
const int FIRST_SHARE = 8;
const int WALK_ALL = 0;
const int WALK_FIRST = 1;
const int WALK_OTHERS = 2;

int walked_turn(int walked)
{
  if (walked_part == WALK_FIRST) {
    return walked * FIRST_SHARE;
  }
  return (walked_part == WALK_OTHERS) ? walked + walked / (FIRST_SHARE - 1) + 1 : walked;
}

// Rasterizes the run of segments of this thread.
void walk_run(ivec2 size)
{
  int group = int(gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x);
  int index = group_in_object(group) * int(gl_WorkGroupSize.x) + int(gl_LocalInvocationID.x);
  int pieces = view.drawn_points - 1;
  int runs = (pieces + RUN_LENGTH - 1) / RUN_LENGTH;
  int turn = walked_turn(index / runs);
  int run = turn * runs + index % runs;
  if (turn >= view.drawn_strands || is_left_out(run)) {
    return;
  }
  int strand = drawn_strand(turn);
  // The runs of a strand are equally long, as threads that run together wait for the longest.
  int piece = index % runs * pieces / runs;
  int last = (index % runs + 1) * pieces / runs;
  ivec2 texel = strand_first(strand);
  vec4 head = packed_head(strands, texel);
  vec4 first = strand_point(strand, texel, head, piece_start(piece));
  vec4 start = to_clip(first);
  vec2 axis = axis_place(vec2(size));
  for (; piece < last; piece++) {
    vec4 second = strand_point(strand, texel, head, piece_start(piece + 1));
    vec4 end = to_clip(second);
    vec2 left = vec2(0.0, 1.0);
    vec4 left_first = first;
    vec4 left_second = second;
    vec4 left_start = start;
    vec4 left_end = end;
    if (IS_CLIPPED) {
      vec3 from = (view.object_to_world * vec4(first.xyz, 1.0)).xyz;
      left = part_left(from, (view.object_to_world * vec4(second.xyz, 1.0)).xyz);
      left_first = mix(first, second, left.x);
      left_second = mix(first, second, left.y);
      left_start = mix(start, end, left.x);
      left_end = mix(start, end, left.y);
    }
    Segment segment;
    vec2 radii = vec2(left_first.w, left_second.w);
    if (left.x < left.y && segment_in_front(left_start, left_end, radii, vec2(size), axis, segment)) {
      begin(strand, piece, segment, left_first, left_second);
      bool is_whole_end = left.y == 1.0 && segment.part.y == 1.0;
      bool is_first = piece == 0 && left.x == 0.0 && segment.part.x == 0.0;
      bool is_last = piece + 1 == pieces && is_whole_end;
      walk_to_ends(segment, bvec2(is_first, is_last), size);
      if (IS_ROUND && piece + 1 < pieces && is_whole_end && segment.half_width.y >= LEAST_BEND) {
        vec4 third = to_clip(strand_point(strand, texel, head, piece_start(piece + 2)));
        if (third.z + third.w > 0.0) {
          vec2 next = sample_place(third, vec2(size)).xy;
          fill_bend(segment.start.xy, segment.end.xy, next, segment.half_width.y, size);
        }
      }
    }
    first = second;
    start = end;
  }
  end_run(run);
}
