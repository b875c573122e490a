// SPDX-License-Identifier: GPL-3.0-or-later
//
// Curl (curl.py): a helix or a wave around the strand's own path, in step with the centre of its lock. Stands after
// beside.h.

const float radius = number[8], pitch = number[9], roundness = number[10], coherence = number[11];
const float stretch = number[12], left_handed = number[13], switchback = number[14], keep = number[7];
const float two_pi = 6.28318530718f;
const float turn = sqrtf(two_pi * radius * two_pi * radius + pitch * pitch);
const float per_square = 0.5f * two_pi * two_pi * (1.0f + roundness * roundness);
// -1 for locks that wind to the left, 1 for others. Few are in between, and flat: so the part may be a slider.
const lanes side = random_number(lock, seed, ints(CLUMP_HAND)) - left_handed * 1.05f + 0.025f;
const lanes hand = clamped(side * 40.0f, lanes(-1.0f), lanes(1.0f));
lanes turns = random_number(lock, seed, ints(CLUMP_PHASE)) + (1.0f - coherence) * (random(PHASE) - 0.5f);
const lanes shift = random_number(lock, seed, ints(CLUMP_SHIFT));
// `due` is the phase by the progress made, a turn for each pitch. The phase is led back to it: what a segment reaches
// depends on how far it winds, by (2πR/h)², so less than all of the difference at once.
lanes due = turns, winding = 0.0f, before = 0.0f, radius_before = 0.0f;
move_across(
    [&](int i, lanes s, lanes x, lanes& to_u, lanes& to_v) {
      const lanes wound = base * radius * profile(x) * smoothstep(s * (2.0f / turn));
      const lanes middle = 0.5f * (wound + radius_before);
      const lanes rise = stretch != 0.0f ? pitch * (1.0f + stretch * (1.0f - x)) : lanes(pitch);
      lanes rate = 1.0f / sqrt_of(per_square * middle * middle + rise * rise);
      const lanes reach = rise * rate;
      winding = stretch != 0.0f ? 1.0f / rise : lanes(1.0f / pitch);
      if (keep != 1.0f) rate = (1.0f - keep) * winding + keep * rate;
      if (switchback > 0.0f) {
        // The sense of winding is a noise of the lock: -1 or 1 in each cell, and a short passage from cell to cell.
        const lanes place = (s + lead * (turn / pitch)) * (1.0f / switchback) + shift;
        const lanes cell = floor_of(place);
        const auto sense_of = [&](lanes which) {
          return random_number(lock, seed, to_ints(which) + CLUMP_CELLS) < 0.5f ? lanes(-1.0f) : lanes(1.0f);
        };
        const lanes here = sense_of(cell);
        const lanes sense = here + (sense_of(cell + 1.0f) - here) * smoothstep((place - cell - 0.7f) * (1.0f / 0.3f));
        rate *= sense;
        winding *= sense;
      }
      if (i == 1) {
        turns += lead * winding;
        due = turns;
      }
      turns += (s - before) * rate + (due - turns) * reach * reach;
      before = s;
      radius_before = wound;
      lanes sine, cosine;
      sine_and_cosine(turns, sine, cosine);
      to_u = wound * cosine;
      to_v = wound * sine * roundness * hand;
      if (is_beside) in_centre_frame(to_u, to_v);
    },
    lanes(0.0f),
    lanes(0.0f),
    u_first,
    [&](lanes progress, lanes forward, const vector& forwards, const vector& u, const vector& v) {
      const lanes lead_before = lead;
      if (is_beside) keep_beside(progress, forward, forwards, u, v);
      due += (forward + lead - lead_before) * winding;
    }
);
