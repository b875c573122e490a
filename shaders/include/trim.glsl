// SPDX-License-Identifier: GPL-3.0-or-later
// Trim (core/styling/trim.h): strands become shorter or longer, cut along themselves or scaled.

#include "include/styled_strand.glsl"

// A cubic through the places around segment at + 1, a part f along it [Catmull74]; straight on past the ends.
vec3 curve_at(int at, float f)
{
  vec3 p1 = places[at].xyz;
  vec3 p2 = places[at + 1].xyz;
  vec3 p0 = (at > 0) ? places[max(at - 1, 0)].xyz : 2.0 * p1 - p2;
  vec3 p3 = (at < POINTS - 2) ? places[min(at + 2, POINTS - 1)].xyz : 2.0 * p2 - p1;
  vec3 bent = 2.0 * p0 - 5.0 * p1 + 4.0 * p2 - p3;
  vec3 twist = 3.0 * (p1 - p2) + p3 - p0;
  return p1 + ((p2 - p0) + (bent + twist * f) * f) * (0.5 * f);
}

// Arc length at which the strand first crosses a plane through its root plus `plane` along the axis.
float crossing_of(vec3 axis, float plane)
{
  float before = -plane;
  if (before > 0.0) {
    return 0.0;
  }
  for (int i = 1; i < styling.point_count; i++) {
    float beyond = dot(places[i].xyz, axis) - plane;
    if (beyond > 0.0 && before <= 0.0) {
      return places[i - 1].w - segment_at(i).w * before / (beyond - before);
    }
    before = beyond;
  }
  return 3e38;
}

void trim(Step row)
{
  float factor = row.numbers[2].x;
  float random_part = row.numbers[2].y;
  float to_length = row.numbers[2].z;
  float undercoat = row.numbers[2].w;
  float undercoat_length = row.numbers[3].x;
  bool is_cut = row.numbers[3].y != 0.0;
  bool has_plane = row.numbers[3].z != 0.0;
  // Strands with the lowest numbers are the undercoat, by degrees: so the part may be a slider.
  float coat = clamp((undercoat * 1.05 - random_of(row.seed, RANDOM_UNDERCOAT)) * 20.0, 0.0, 1.0);
  float wanted = min(total * factor * (1.0 - random_part * random_of(row.seed, RANDOM_LENGTH)), to_length);
  wanted *= 1.0 + (undercoat_length - 1.0) * coat;
  put_places(false);
  vec3 axis = vec3(row.numbers[3].w, row.numbers[4].xy);
  float plane = row.numbers[4].z - dot(strand_root, axis);
  bool is_at_plane = false;
  if (has_plane) {
    float crossing = crossing_of(axis, plane);
    is_at_plane = crossing < wanted && crossing > 0.0 && base_amount == 1.0;
    wanted = min(wanted, crossing);
  }
  wanted = total + base_amount * (wanted - total);
  if (!is_cut) {
    for (int i = 1; i < styling.point_count; i++) {
      vec4 own = segment_at(i);
      put_segment(i, own.xyz, own.w * wanted * per_total);
    }
    put_total();
    return;
  }
  if (abs(wanted * per_total - 1.0) < 1e-7) {
    return;
  }
  vec3 last = segment_at(POINTS - 1).xyz;
  float exact = 1.0;
  // The curve through the points is not where the points' segments are: its tip is brought back to the plane.
  for (int pass = 0; pass < (has_plane ? 3 : 1); pass++) {
    float scale = wanted * per_total;
    int at = 0;
    float sum = 0.0;
    vec3 before = vec3(0.0);
    vec3 direction = segment_at(1).xyz;
    for (int i = 1; i < styling.point_count; i++) {
      float reached = places[i].w * scale;
      while (at < POINTS - 2 && places[at + 1].w < reached) {
        at++;
      }
      float range = places[at + 1].w - places[at].w;
      float f = (range > 1e-12) ? clamp((reached - places[at].w) / range, 0.0, 1.0) : 0.0;
      vec3 here = curve_at(at, f) + last * max(reached - total, 0.0);
      vec3 way = here - before;
      float size = length(way);
      direction = unit_or(way, 1e-12, direction);
      put_next(i, direction, size);
      before = here;
      sum += size;
    }
    exact = wanted / max(sum, 1e-20);
    if (has_plane) {
      vec3 tip = vec3(0.0);
      for (int i = 1; i < styling.point_count; i++) {
        vec4 made = next_at(i);
        tip += made.xyz * (made.w * exact);
      }
      float slope = max(dot(direction, axis), 0.1);
      if (is_at_plane) {
        wanted -= (dot(tip, axis) - plane) / slope;
      }
      wanted = max(wanted, 0.0);
    }
  }
  for (int i = 1; i < styling.point_count; i++) {
    vec4 made = next_at(i);
    put_segment(i, made.xyz, made.w * exact);
  }
  put_total();
}
