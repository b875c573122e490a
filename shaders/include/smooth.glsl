// SPDX-License-Identifier: GPL-3.0-or-later
// Smooth (core/styling/smooth.h): directions of chords around each segment, twice. Two places run along the strand, so
// the cost does not depend on the length of the chords.

#include "include/styled_strand.glsl"

// The place at an arc length that does not decrease; at: the point before it.
vec3 place_at(float arc, inout int at)
{
  while (places[at + 1].w <= arc && at < POINTS - 2) {
    at++;
  }
  vec4 start = places[at];
  vec4 end = places[at + 1];
  float range = end.w - start.w;
  return start.xyz + (end.xyz - start.xyz) * ((range > 1e-12) ? (arc - start.w) / range : 0.0);
}

void smooth_strand(Step row)
{
  float reach = 0.5 * row.numbers[2].x;
  for (int pass = 0; pass < 2; pass++) {
    put_places(pass == 1);
    int behind = 0;
    int before = 0;
    for (int i = 1; i < styling.point_count; i++) {
      vec4 own = segment_at(i);
      float middle = 0.5 * (places[i - 1].w + places[i].w);
      float back = max(middle - reach, 0.0);
      float forth = min(middle + reach, total);
      vec3 chord = place_at(forth, before) - place_at(back, behind);
      vec3 made = unit_or(chord, 1e-3 * (forth - back), (pass == 0) ? own.xyz : next_at(i).xyz);
      put_next(i, made, own.w);
    }
  }
  float arc = 0.0;
  for (int i = 1; i < styling.point_count; i++) {
    vec4 own = segment_at(i);
    arc += own.w;
    float amount = base_amount * profile(course, arc * per_total);
    put_segment(i, unit_or(own.xyz * (1.0 - amount) + next_at(i).xyz * amount, 1e-3, own.xyz), own.w);
  }
}
