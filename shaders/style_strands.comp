// SPDX-License-Identifier: GPL-3.0-or-later
// A program of styles on strands where they are drawn: core/styling/steps.cpp on any GPU, one strand a thread.
//
// HAS_CURL and the like: the kinds of its steps. Other kinds are not compiled.

#include "include/bend.glsl"
#include "include/clump.glsl"
#include "include/curl.glsl"
#include "include/frizz.glsl"
#include "include/put_packed_strand.glsl"
#include "include/smooth.glsl"
#include "include/strand.glsl"
#include "include/styled_strand.glsl"
#include "include/trim.glsl"
#include "include/weave.glsl"

// Numbers of a strand in `known`: its normal, its identity in two parts, its clump centre of each level, its masks.
const int KNOWN_LEVELS = 5;

float known_number(ivec2 first, int number)
{
  return texelFetch(known, first + ivec2(number / 4, 0), 0)[number % 4];
}

int whole(float high, float low)
{
  return int((uint(high) << 16u) | uint(low));
}

// Directions and lengths of the segments between points. A segment without length goes on as the one before.
void read_strand(ivec2 first)
{
  half_now = 0;
  total = 0.0;
  vec3 direction = strand_normal;
  vec3 before = imageLoad(plain_strands, first).xyz;
  strand_root = before;
  for (int i = 1; i < styling.point_count; i++) {
    vec3 here = imageLoad(plain_strands, first + ivec2(i, 0)).xyz;
    vec3 along = here - before;
    float size = length(along);
    direction = (size > 1e-12) ? along / size : direction;
    put_segment(i, direction, size);
    total += size;
    before = here;
  }
}

// The clump centre that a step counts the strand to.
void take_centre(ivec2 first, Step row)
{
  centre = row.first_centre;
  centre_normal = strand_normal;
  lock = strand_identity;
  in_lock = 0.0;
  int member = int(known_number(first, KNOWN_LEVELS + row.level));
  if (member < 0) {
    if (row.kind == KIND_CLUMP || row.kind == KIND_WEAVE) {
      base_amount = 0.0;
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

void apply(Step row)
{
#ifdef HAS_TRIM
  if (row.kind == KIND_TRIM) {
    trim(row);
  }
#endif
#ifdef HAS_CLUMP
  if (row.kind == KIND_CLUMP) {
    clump(row);
  }
#endif
#ifdef HAS_CURL
  if (row.kind == KIND_CURL) {
    curl(row);
  }
#endif
#ifdef HAS_FRIZZ
  if (row.kind == KIND_FRIZZ) {
    frizz(row);
  }
#endif
#ifdef HAS_BEND
  if (row.kind == KIND_BEND) {
    bend(row);
  }
#endif
#ifdef HAS_SMOOTH
  if (row.kind == KIND_SMOOTH) {
    smooth_strand(row);
  }
#endif
#ifdef HAS_WEAVE
  if (row.kind == KIND_WEAVE) {
    weave(row);
  }
#endif
}

// A point from the root on, in the coordinates that are drawn. A strand that no style has touched keeps its points.
vec3 drawn_offset(ivec2 first, int i, vec3 from_root, bool is_touched)
{
  vec3 offset = is_touched ? from_root : imageLoad(plain_strands, first + ivec2(i, 0)).xyz - strand_root;
  return (styling.to_drawn * vec4(offset, 0.0)).xyz;
}

void write_strand(int strand, ivec2 first, bool is_touched)
{
  vec3 from_root = vec3(0.0);
  float range = 0.0;
  for (int i = 1; i < styling.point_count; i++) {
    vec4 along = segment_at(i);
    from_root += along.xyz * along.w;
    vec3 extent = abs(drawn_offset(first, i, from_root, is_touched));
    range = max(range, max(extent.x, max(extent.y, extent.z)));
  }
  vec3 root = (styling.to_drawn * vec4(strand_root, 0.0)).xyz;
  begin_strand(strand, root, range, POINTS, styling.row_packed);
  from_root = vec3(0.0);
  for (int i = 1; i < styling.point_count; i++) {
    vec4 along = segment_at(i);
    from_root += along.xyz * along.w;
    put_point(i, drawn_offset(first, i, from_root, is_touched));
  }
  end_strand(strand);
}

// Points of a centre strand, with their arc lengths.
void write_centre(ivec2 first, bool is_touched)
{
  vec3 from_root = vec3(0.0);
  float arc = 0.0;
  for (int i = 0; i < styling.point_count; i++) {
    vec4 texel = imageLoad(plain_strands, first + ivec2(i, 0));
    if (i > 0) {
      vec4 along = segment_at(i);
      from_root += along.xyz * along.w;
      arc += along.w;
    }
    vec3 here = is_touched ? strand_root + from_root : texel.xyz;
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
  int strand = first_strand + place;
  ivec2 known_first = strand_texel(strand, 0, styling.known_texels, styling.row_known);
  vec4 head = texelFetch(known, known_first, 0);
  strand_normal = head.xyz;
  strand_identity = whole(head.w, known_number(known_first, 4));
  ivec2 first = strand_texel(styling.first_strand + place, 0, POINTS, styling.row_strands);
  read_strand(first);
  bool is_touched = false;
  for (int index = 0; index < styling.step_count; index++) {
    Step row = styling.steps[index];
    // A_si = base · profile(x_i).
    base_amount = row.numbers[0].x * (1.0 - row.numbers[0].y * random_of(row.seed, RANDOM_VARY));
    if (row.mask >= 0) {
      base_amount *= known_number(known_first, KNOWN_LEVELS + styling.level_count + row.mask);
    }
    take_centre(known_first, row);
    if (base_amount > 0.0) {
      is_touched = true;
      course = course_of(row.numbers[0].zw, row.numbers[1].xyz, POINTS);
      per_total = 1.0 / max(total, 1e-20);
      apply(row);
    }
  }
  if (styling.are_centres != 0) {
    write_centre(first, is_touched);
  }
  else {
    write_strand(strand, first, is_touched);
  }
}
