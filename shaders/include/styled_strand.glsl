// SPDX-License-Identifier: GPL-3.0-or-later
// The strand that styles are applied to, one after the other: needs POINTS, and the block `styling`.
//
// It is held as its root, unit directions t_i and lengths d_i of its segments, i = 1 … POINTS - 1: xyz and w of
// `segment_at(i)`. So a style that turns segments keeps roots and lengths. A style that writes what it reads again
// writes into the other half of the array, by `put_next`, and exchanges both.

#include "include/style_numbers.glsl"

vec4 segments[2 * POINTS];
int half_now;  // 0, or POINTS
#if defined(HAS_TRIM) || defined(HAS_SMOOTH)
vec4 places[POINTS];  // points from the root on, which round less than places do, and their arc lengths: `put_places`
#endif

vec3 strand_root;
vec3 strand_normal;  // of the surface at the root
int strand_identity;
float total;  // of all lengths
float per_total;

// What the present step takes of its style.
float base_amount;
Course course;
// The clump centre of the strand: its normal is the reference of frames, which every strand of a clump shares. A strand
// without a centre stands for itself.
int centre;
vec3 centre_normal;
int lock;  // its identity
float in_lock;

vec4 segment_at(int i)
{
  return segments[half_now + i];
}

void put_segment(int i, vec3 direction, float size)
{
  segments[half_now + i] = vec4(direction, size);
}

vec4 next_at(int i)
{
  return segments[POINTS - half_now + i];
}

void put_next(int i, vec3 direction, float size)
{
  segments[POINTS - half_now + i] = vec4(direction, size);
}

void exchange()
{
  half_now = POINTS - half_now;
}

// To be called where lengths have changed.
void put_total()
{
  total = 0.0;
  for (int i = 1; i < styling.point_count; i++) {
    total += segment_at(i).w;
  }
}

#if defined(HAS_TRIM) || defined(HAS_SMOOTH)
// From directions and lengths, those of the other half if they `are_next`.
void put_places(bool are_next)
{
  vec4 here = vec4(0.0);
  places[0] = here;
  for (int i = 1; i < styling.point_count; i++) {
    vec4 along = are_next ? next_at(i) : segment_at(i);
    here += vec4(along.xyz * along.w, along.w);
    places[i] = here;
  }
}
#endif

// A number of the strand, by seed and purpose.
float random_of(int seed, int purpose)
{
  return random_number(strand_identity, seed, purpose);
}

// Across both, the other way where the surface's own axes are mirrored: all styles are mirrored with them.
vec3 upward_of(vec3 along, vec3 sideways)
{
  return cross(along, sideways) * styling.hand;
}

// The first segment's frame, of the reference at the centre.
vec3 first_frame(vec3 at_centre)
{
  return turned(turned(at_centre, centre_normal, strand_normal), strand_normal, segment_at(1).xyz);
}
