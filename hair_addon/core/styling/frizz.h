// SPDX-License-Identifier: GPL-3.0-or-later
//
// Frizz (frizz.py): band-limited noise across the strand, WAVES an octave.

const float amplitude = number[8], wavelength = number[9], gain = number[11], coherence = number[12];
const float per_spread = number[13], stray = number[14], stray_gain = number[15];
const int octave_count = static_cast<int>(number[10]);
const lanes per_spacing = (point_count - 1) * per_total;
// Strands with the lowest numbers fly away, by degrees: so the part may be a slider.
const lanes is_stray =
    stray > 0.0f ? clamped((1.1f * stray - random(STRAY)) * 10.0f, lanes(0.0f), lanes(1.0f)) : lanes(0.0f);
const lanes size = base * amplitude * (1.0f + (stray_gain - 1.0f) * is_stray);
// A wave is the real part of (even + i odd) e^(i 2π f s).
lanes even[WAVES * MOST_OCTAVES], odd[WAVES * MOST_OCTAVES];
float octave_gain = 1.0f;
for (int wave = 0; wave < WAVES * octave_count; ++wave) {
  const float frequency = number[16 + wave % WAVES] * static_cast<float>(1 << (wave / WAVES)) / wavelength;
  const lanes weight = octave_gain * smoothstep((per_spacing / frequency - 2.0f) * 0.5f);
  lanes phase = (1.0f - coherence) * random(WAVE_PHASES + wave);
  if (coherence > 0.0f) {
    // k_m has a random direction and a random size about 1 / spread turns.
    const auto pick = [&](int part) { return random_number(ints(wave), seed, ints(WAVE_VECTORS + part)); };
    const lanes z = 2.0f * pick(0) - 1.0f, flat = sqrt_of(higher_of(1.0f - z * z, lanes(0.0f)));
    lanes sine, cosine;
    sine_and_cosine(pick(1), sine, cosine);
    const vector direction = {flat * cosine, flat * sine, z};
    const vector rest = {
        axes.data[0][0] * root.x + axes.data[0][1] * root.y + axes.data[0][2] * root.z + axes.data[0][3],
        axes.data[1][0] * root.x + axes.data[1][1] * root.y + axes.data[1][2] * root.z + axes.data[1][3],
        axes.data[2][0] * root.x + axes.data[2][1] * root.y + axes.data[2][2] * root.z + axes.data[2][3],
    };
    phase += coherence * per_spread * (0.7f + 0.6f * pick(2)) * dot(direction, rest) + coherence * pick(3);
  }
  lanes sine, cosine;
  sine_and_cosine(phase, sine, cosine);
  even[wave] = weight * cosine;
  odd[wave] = weight * sine;
  if (wave % WAVES == WAVES - 1) octave_gain *= gain;
}
float frequencies[WAVES];
for (int first = 0; first < WAVES; ++first) frequencies[first] = number[16 + first] / wavelength;
// The noise at all points, in `place`, before any moves: its coefficients and what moves points across their strand do
// not fit the registers of a GPU together. OCTAVES: at least as many as there are.
const auto put_noise = [&](auto octaves) {
  constexpr int OCTAVES = decltype(octaves)::value, COUNT = WAVES * OCTAVES;
  lanes evens[COUNT], odds[COUNT];
#pragma unroll
  for (int wave = 0; wave < COUNT; ++wave) {
    const bool is_there = wave < WAVES * octave_count;
    evens[wave] = is_there ? even[wave] : lanes(0.0f);
    odds[wave] = is_there ? odd[wave] : lanes(0.0f);
  }
  lanes s = 0.0f;
  for (int i = 0; i < point_count; ++i) {
    if (i > 0) s += length[i];
    lanes to_u = 0.0f, to_v = 0.0f;
#pragma unroll
    for (int first = 0; first < WAVES; ++first) {
      lanes sine, cosine;
      sine_and_cosine(frequencies[first] * s, sine, cosine);
      const float sense = first % 2 ? -1.0f : 1.0f;
#pragma unroll
      for (int wave = first; wave < COUNT; wave += WAVES) {
        to_u = fused(evens[wave], cosine, fused(-odds[wave], sine, to_u));
        to_v = fused(lanes(sense) * evens[wave], sine, fused(lanes(sense) * odds[wave], cosine, to_v));
        // The next octave has twice the angle.
        const lanes twice = 2.0f * sine * cosine;
        cosine = fused(-2.0f * sine, sine, lanes(1.0f));
        sine = twice;
      }
    }
    const lanes amount = size * profile(s * per_total);
    place[i].x = to_u * amount;
    place[i].y = to_v * amount;
  }
};
struct two_octaves {
  enum { value = 2 };
};
struct most_octaves {
  enum { value = MOST_OCTAVES };
};
if (octave_count <= 2) {
  put_noise(two_octaves{});
} else {
  put_noise(most_octaves{});
}
move_across(
    [&](int i, lanes, lanes, lanes& to_u, lanes& to_v) {
      to_u = place[i].x;
      to_v = place[i].y;
    },
    place[0].x,
    place[0].y,
    first_frame(reference()),
    [](lanes, lanes, const vector&, const vector&, const vector&) {}
);
