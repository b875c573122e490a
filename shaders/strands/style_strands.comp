// SPDX-License-Identifier: GPL-3.0-or-later
// Applies a program of styles to strands on the GPU: core/styling/steps.cpp on any GPU, one strand per thread.
//
// all.strand contains the kinds of steps; HAS_TRIM and the like select those of the program.

#include "strands/write_packed_strand.glsl"
#include "strands/strip.glsl"
#include "strands/strand_language.glsl"

// Numbers of a strand in `known`: its normal, its identity in two parts, its clump center in each level, its masks, and
// the numbers of steps that differ between strands.
const int KNOWN_LEVELS = 5;
ivec2 known_first;

float known_number(int number)
{
  return texelFetch(known, known_first + ivec2(number / 4, 0), 0)[number % 4];
}

float varied_number_at(int place)
{
  if (((row_now.varied >> place) & 1) == 0) {
    return number_at(place);
  }
  int row = row_now.first_varied + bitCount(row_now.varied & ((1 << place) - 1));
  return known_number(KNOWN_LEVELS + styling.level_count + row);
}

// The row of a course of the step, by its place in `COURSES`; -1: none. Values of a row.
int course_row(int slot)
{
  return ((row_now.courses >> (slot * COURSE_BITS)) & ((1 << COURSE_BITS) - 1)) - 1;
}

float course_sample(int row, int at)
{
  int place = row * COURSE_SAMPLES + at;
  return styling.courses[place / 4][place % 4];
}

#include "all.strand"

int whole(float high, float low)
{
  return int((uint(high) << 16u) | uint(low));
}

// Reads directions and lengths of the segments between points. A segment without length has the direction before it.
void read_strand(ivec2 first)
{
  half_now = 0;
  total = 0.0;
  vec3 direction = normal;
  vec3 before = imageLoad(plain_strands, first).xyz;
  root = before;
  for (int i = 1; i < styling.point_count; i++) {
    vec3 here = imageLoad(plain_strands, first + ivec2(i, 0)).xyz;
    vec3 along = here - before;
    float size = length(along);
    direction = (size > 1e-12) ? along / size : direction;
    set_direction(i, direction);
    set_length(i, size);
    total += size;
    before = here;
  }
}

// Reads a strand that `keep_strand` has written; returns whether a step has changed it.
bool read_kept(ivec2 first)
{
  vec4 texel = imageLoad(plain_strands, first);
  if (texel.w < 0.0) {
    read_strand(first);
    return false;
  }
  half_now = 0;
  root = texel.xyz;
  total = texel.w;
  for (int i = 1; i < styling.point_count; i++) {
    texel = imageLoad(plain_strands, first + ivec2(i, 0));
    set_direction(i, texel.xyz);
    set_length(i, texel.w);
  }
  return true;
}

// Writes a strand between two steps in place of its points: its root and total length, then its directions and lengths.
// A strand that no step has changed keeps its points, and has a negative length.
void keep_strand(ivec2 first, bool is_touched)
{
  imageStore(plain_strands, first, vec4(root, is_touched ? total : -1.0));
  if (!is_touched) {
    return;
  }
  for (int i = 1; i < styling.point_count; i++) {
    imageStore(plain_strands, first + ivec2(i, 0), vec4(direction_at(i), length_at(i)));
  }
}

// Sets the clump center of the strand in a step.
void take_centre()
{
  centre = row_now.first_centre;
  centre_normal = normal;
  lock = identity;
  in_lock = 0.0;
  has_centre_points = row_now.level >= 0 && centre < styling.centre_count;
  int member = int(known_number(KNOWN_LEVELS + row_now.level));
  if (member < 0) {
    if (((NEEDING_CENTRE >> kind) & 1) != 0) {
      base = 0.0;
    }
    return;
  }
  in_lock = 1.0;
  centre += member;
  ivec2 texel = strand_texel(centre, 0, 2, styling.row_locks);
  vec4 its = texelFetch(locks, texel, 0);
  centre_normal = its.xyz;
  lock = whole(its.w, texelFetch(locks, texel + ivec2(1, 0), 0).x);
}

void take_profile()
{
  at_root = varied_number_at(AT_ROOT_NUMBER);
  at_tip = varied_number_at(AT_TIP_NUMBER);
  exponent = varied_number_at(EXPONENT_NUMBER);
  is_flipped = varied_number_at(IS_FLIPPED_NUMBER) != 0.0;
  from = varied_number_at(FROM_NUMBER);
  has_profile = at_root != at_tip;
  has_start = from != 0.0;
  is_curved = exponent != 1.0 || is_flipped;
  has_flipped = is_flipped;
  least = 0.5 / float(POINTS - 1);
  slope = 1.0 / power(least, 1.0 - exponent);
}

// Offset of a point from the root, in the coordinates of drawn strands. A strand that no style has changed keeps its points.
vec3 drawn_offset(ivec2 first, int i, vec3 from_root, bool is_touched)
{
  vec3 offset = is_touched ? from_root : imageLoad(plain_strands, first + ivec2(i, 0)).xyz - root;
  return (styling.to_drawn * vec4(offset, 0.0)).xyz;
}

void write_strand(int strand, ivec2 first, bool is_touched)
{
  vec3 from_root = vec3(0.0);
  float range = 0.0;
  for (int i = 1; i < styling.point_count; i++) {
    from_root += direction_at(i) * length_at(i);
    vec3 extent = abs(drawn_offset(first, i, from_root, is_touched));
    range = max(range, max(extent.x, max(extent.y, extent.z)));
  }
  vec3 root = (styling.to_drawn * vec4(root, 0.0)).xyz;
  begin_strand(strand, root, range, POINTS, styling.row_packed);
  from_root = vec3(0.0);
  for (int i = 1; i < styling.point_count; i++) {
    from_root += direction_at(i) * length_at(i);
    put_point(i, drawn_offset(first, i, from_root, is_touched));
  }
  end_strand(strand);
}

// Writes the points of a center strand, with their arc lengths.
void write_centre(ivec2 first, bool is_touched)
{
  vec3 from_root = vec3(0.0);
  float arc = 0.0;
  for (int i = 0; i < styling.point_count; i++) {
    vec4 texel = imageLoad(plain_strands, first + ivec2(i, 0));
    if (i > 0) {
      from_root += direction_at(i) * length_at(i);
      arc += length_at(i);
    }
    vec3 here = is_touched ? root + from_root : texel.xyz;
    imageStore(plain_strands, first + ivec2(i, 0), vec4(here, arc));
  }
}

void main()
{
  int group = int(gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x);
  int place = group * int(gl_WorkGroupSize.x) + int(gl_LocalInvocationID.x);
  if (place >= some_count) {
    return;
  }
  point_count = styling.point_count;
  hand = styling.hand;
  int strand = first_strand + place;
  known_first = strand_texel(strand, 0, styling.known_texels, styling.row_known);
  vec4 head = texelFetch(known, known_first, 0);
  normal = head.xyz;
  identity = whole(head.w, known_number(4));
  ivec2 first = strand_texel(styling.first_strand + place, 0, POINTS, styling.row_strands);
  bool is_touched = false;
  if (first_step > 0) {
    is_touched = read_kept(first);
  }
  else {
    read_strand(first);
  }
  for (int index = first_step; index < end_step; index++) {
    row_now = styling.steps[index];
    kind = row_now.kind;
    seed = row_now.seed;
    keep_length = varied_number_at(KEEP_LENGTH_NUMBER);
    keeps_all_length = keep_length == 1.0;
    // A_si = base · profile(x_i).
    base = varied_number_at(AMOUNT_NUMBER) * (1.0 - varied_number_at(VARY_NUMBER) * random(VARY));
    if (row_now.mask >= 0) {
      base *= known_number(KNOWN_LEVELS + styling.level_count + row_now.mask);
    }
    take_centre();
    if (base > 0.0) {
      is_touched = true;
      take_profile();
      per_total = 1.0 / max(total, 1e-20);
      apply_step();
    }
  }
  if (styling.are_centres != 0) {
    write_centre(first, is_touched);
  }
  else if (end_step < styling.step_count) {
    keep_strand(first, is_touched);
  }
  else {
    write_strand(strand, first, is_touched);
  }
}
