// SPDX-License-Identifier: GPL-3.0-or-later
// Curl (core/styling/curl.h): a helix or a wave around the strand's own path, in step with the centre of its lock.

#include "include/across.glsl"
#include "include/beside.glsl"

// The sense of winding of a lock at a place in cells of a switchback: -1 or 1, with short passages from cell to cell.
float winding_sense(int identity, int seed, float place)
{
  float cell = floor(place);
  float here = (random_number(identity, seed, int(cell) + RANDOM_CLUMP_CELLS) < 0.5) ? -1.0 : 1.0;
  float beyond = (random_number(identity, seed, int(cell + 1.0) + RANDOM_CLUMP_CELLS) < 0.5) ? -1.0 : 1.0;
  return here + (beyond - here) * smoothstep(0.0, 1.0, (place - cell - 0.7) / 0.3);
}

void curl(Step row)
{
  float radius = row.numbers[2].x;
  float pitch = row.numbers[2].y;
  float roundness = row.numbers[2].z;
  float coherence = row.numbers[2].w;
  float stretch = row.numbers[3].x;
  float left_handed = row.numbers[3].y;
  float switchback = row.numbers[3].z;
  float keep = row.numbers[1].w;
  const float two_pi = 6.28318530718;
  float turn = sqrt(two_pi * radius * two_pi * radius + pitch * pitch);
  float per_square = 0.5 * two_pi * two_pi * (1.0 + roundness * roundness);
  // -1 for locks that wind to the left, 1 for others. Few are in between, and flat: so the part may be a slider.
  float side = random_number(lock, row.seed, RANDOM_CLUMP_HAND) - left_handed * 1.05 + 0.025;
  float hand = clamp(side * 40.0, -1.0, 1.0);
  float turns = random_number(lock, row.seed, RANDOM_CLUMP_PHASE) + (1.0 - coherence) * (random_of(row.seed, RANDOM_PHASE) - 0.5);
  float shift = random_number(lock, row.seed, RANDOM_CLUMP_SHIFT);
  vec3 at_centre = reference(centre_normal, styling.axes);
  vec3 u_first = first_frame(at_centre);
  bool is_beside = row.level >= 0 && row.first_centre < styling.centre_count;
  Beside beside;
  beside.lead = 0.0;
  if (is_beside) {
    beside = begin_beside(at_centre, u_first);
  }
  // `due` is the phase by the progress made, a turn for each pitch. The phase is led back to it: what a segment reaches
  // depends on how far it winds, by (2πR/h)², so less than all of the difference at once.
  float due = turns;
  float radius_before = 0.0;
  float s = 0.0;
  Walk walk = begin_across(u_first, vec2(0.0));
  for (int i = 1; i < styling.point_count; i++) {
    float d = segment_at(i).w;
    s += d;
    float x = s * per_total;
    float wound = base_amount * radius * profile(course, x) * smoothstep(0.0, 1.0, s * 2.0 / turn);
    float middle = 0.5 * (wound + radius_before);
    radius_before = wound;
    float rise = pitch * (1.0 + stretch * (1.0 - x));
    float rate = 1.0 / sqrt(per_square * middle * middle + rise * rise);
    float reach = rise * rate;
    float winding = 1.0 / rise;
    rate = (1.0 - keep) * winding + keep * rate;
    if (switchback > 0.0) {
      float sense = winding_sense(lock, row.seed, (s + beside.lead * (turn / pitch)) / switchback + shift);
      rate *= sense;
      winding *= sense;
    }
    if (i == 1) {
      turns += beside.lead * winding;
      due = turns;
    }
    turns += d * rate + (due - turns) * reach * reach;
    vec2 wave = sine_and_cosine(turns);
    vec2 offset = wound * vec2(wave.y, wave.x * roundness * hand);
    if (is_beside) {
      offset = in_centre_frame(beside, offset);
    }
    Passed passed = pass_across(walk, i, offset, keep);
    float lead_before = beside.lead;
    if (is_beside) {
      keep_beside(
          beside, walk.progress, passed.forward, passed.forwards, passed.sideways, passed.upward, 6.0 / pitch
      );
    }
    due += (passed.forward + beside.lead - lead_before) * winding;
  }
  end_across(keep);
}
