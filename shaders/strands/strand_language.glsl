// SPDX-License-Identifier: GPL-3.0-or-later
// The language of .strand files in GLSL, one strand per thread; core/styling/strand_language.h defines it in C++ and
// documents it. Needs POINTS, the block `styling` and the image `centres`.
//
// A segment is its direction in xyz and its length in w. Next segments are in the other half of the array.

#include "strands/strip.glsl"

#include "strands/lanes.glsl"
#include "style_numbers.strand"

vec4 segments[2 * POINTS];
int half_now;  // 0, or POINTS
#if defined(HAS_TRIM) || defined(HAS_SMOOTH)
vec4 places[POINTS];  // points from the root on, and their arc lengths: `put_points`
#endif
float spare[15];

vec3 root;
vec3 normal;  // of the surface at the root
int identity;
int point_count;  // POINTS; a variable, as drivers take longer to compile loops to a constant
float hand;  // -1 if the surface's axes are mirrored
float total;  // of all lengths
float per_total;

// The current step.
Step row_now;
int kind;
int seed;
float base;  // its amount on this strand
float keep_length;
bool keeps_all_length;
float at_root;
float at_tip;
float exponent;
float from;
bool is_flipped;
bool has_profile;
bool has_start;
bool is_curved;
bool has_flipped;
float least;
float slope;
// The clump center of the strand, whose normal is the reference of the frames shared by all strands of a clump. A strand
// without a center is its own center.
int centre;
vec3 centre_normal;
int lock;  // its identity
float in_lock;
bool has_centre_points;

float number_at(int place)
{
  return row_now.numbers[place / 4][place % 4];
}

vec3 direction_at(int i)
{
  return segments[half_now + i].xyz;
}

float length_at(int i)
{
  return segments[half_now + i].w;
}

void set_direction(int i, vec3 direction)
{
  segments[half_now + i].xyz = direction;
}

void set_length(int i, float size)
{
  segments[half_now + i].w = size;
}

vec3 next_direction_at(int i)
{
  return segments[POINTS - half_now + i].xyz;
}

float next_length_at(int i)
{
  return segments[POINTS - half_now + i].w;
}

void set_next(int i, vec3 direction, float size)
{
  segments[POINTS - half_now + i] = vec4(direction, size);
}

void exchange()
{
  half_now = POINTS - half_now;
}

void put_total()
{
  total = 0.0;
  for (int i = 1; i < point_count; i++) {
    total += length_at(i);
  }
}

#if defined(HAS_TRIM) || defined(HAS_SMOOTH)
void put_points(bool are_next)
{
  vec4 here = vec4(0.0);
  places[0] = here;
  for (int i = 1; i < point_count; i++) {
    vec3 direction = are_next ? next_direction_at(i) : direction_at(i);
    here += vec4(direction * length_at(i), length_at(i));
    places[i] = here;
  }
}

vec3 place_at(int i)
{
  return places[i].xyz;
}

float arc_at(int i)
{
  return places[i].w;
}

  #define place_of place_at
  #define arc_of arc_at

int point_before(int at, float arc)
{
  while (at < POINTS - 2 && places[at + 1].w < arc) {
    at++;
  }
  return at;
}

void take_point(bool is_asked, int at, inout vec3 point, inout float arc)
{
  if (is_asked) {
    point = places[at].xyz;
    arc = places[at].w;
  }
}
#endif

void take_segment(bool is_asked, int at, inout vec3 direction, inout float size)
{
  if (is_asked) {
    direction = direction_at(at);
    size = length_at(at);
  }
}

void set_offset(int i, float to_u, float to_v)
{
  segments[POINTS - half_now + i].xy = vec2(to_u, to_v);
}

float offset_u_at(int i)
{
  return segments[POINTS - half_now + i].x;
}

float offset_v_at(int i)
{
  return segments[POINTS - half_now + i].y;
}

void keep_number(int k, float value)
{
  spare[k] = value;
}

float kept_number(int k)
{
  return spare[k];
}

void read_centre(int at, out vec3 point, out float arc)
{
  vec4 texel = imageLoad(centres, strand_texel(centre, at, POINTS, styling.row_centres));
  point = texel.xyz;
  arc = texel.w;
}

vec3 place_on_surface(vec3 place)
{
  return (styling.axes * vec4(place, 1.0)).xyz;
}

vec3 to_axes(vec3 v)
{
  return (styling.axes * vec4(v, 0.0)).xyz;
}

vec3 from_axes(vec3 v)
{
  return (vec4(v, 0.0) * styling.axes).xyz;
}

float random(int purpose)
{
  return random_number(identity, seed, purpose);
}
