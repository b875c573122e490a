// SPDX-License-Identifier: GPL-3.0-or-later
// The course of a lock's centre strand from the styled strand's root on, which rounds less than places do:
// core/styling/centre_course.h. Needs the image `centres`.

#include "include/strand.glsl"
#include "include/styled_strand.glsl"

// A point of a centre strand, and the arc length there.
vec4 centre_point(int point)
{
  return imageLoad(centres, strand_texel(centre, point, POINTS, styling.row_centres));
}

// The points of the centre around an arc length, which are kept while it stays between them.
struct CentreCourse {
  int at;
  vec4 low;
  vec4 high;
};

CentreCourse begin_course()
{
  CentreCourse walk;
  walk.at = 0;
  walk.low = centre_point(0) - vec4(strand_root, 0.0);
  walk.high = centre_point(1) - vec4(strand_root, 0.0);
  return walk;
}

// The point at an arc length of the centre that does not decrease; past its tip straight on.
vec3 middle_at(inout CentreCourse walk, float ahead)
{
  while (walk.high.w <= ahead && walk.at < POINTS - 2) {
    walk.low = walk.high;
    walk.at++;
    walk.high = centre_point(walk.at + 1) - vec4(strand_root, 0.0);
  }
  float range = walk.high.w - walk.low.w;
  float part = (range > 1e-12) ? (ahead - walk.low.w) / range : 0.0;
  return walk.low.xyz + (walk.high.xyz - walk.low.xyz) * part;
}
