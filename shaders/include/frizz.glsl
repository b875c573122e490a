// SPDX-License-Identifier: GPL-3.0-or-later
// Frizz (core/styling/frizz.h): band-limited noise across the strand, WAVES an octave.

#include "include/across.glsl"

// Phase of a wave that near strands share, in turns: k_m · X with a random direction and a random size about 1 / spread.
float coherent_phase(int wave, int seed, vec3 rest, float per_spread)
{
  float z = 2.0 * random_number(wave, seed, RANDOM_WAVE_VECTORS) - 1.0;
  float flat_part = sqrt(max(1.0 - z * z, 0.0));
  vec2 around = sine_and_cosine(random_number(wave, seed, RANDOM_WAVE_VECTORS + 1));
  vec3 direction = vec3(flat_part * around.y, flat_part * around.x, z);
  float size = per_spread * (0.7 + 0.6 * random_number(wave, seed, RANDOM_WAVE_VECTORS + 2));
  return size * dot(direction, rest) + random_number(wave, seed, RANDOM_WAVE_VECTORS + 3);
}

void frizz(Step row)
{
  float amplitude = row.numbers[2].x;
  float wavelength = row.numbers[2].y;
  int octave_count = int(row.numbers[2].z);
  float gain = row.numbers[2].w;
  float coherence = row.numbers[3].x;
  float per_spread = row.numbers[3].y;
  float stray = row.numbers[3].z;
  float stray_gain = row.numbers[3].w;
  float per_spacing = float(POINTS - 1) * per_total;
  // Strands with the lowest numbers fly away, by degrees: so the part may be a slider.
  float is_stray = 0.0;
  if (stray > 0.0) {
    is_stray = clamp((1.1 * stray - random_of(row.seed, RANDOM_STRAY)) * 10.0, 0.0, 1.0);
  }
  float size = base_amount * amplitude * (1.0 + (stray_gain - 1.0) * is_stray);
  float frequencies[WAVES];
  for (int first = 0; first < WAVES; first++) {
    frequencies[first] = row.numbers[4 + first / 4][first % 4] / wavelength;
  }
  // A wave is the real part of (even + i odd) e^(i 2π f s).
  vec2 waves[WAVES * MOST_OCTAVES];
  float octave_gain = 1.0;
  for (int wave = 0; wave < WAVES * octave_count; wave++) {
    float frequency = frequencies[wave % WAVES] * float(1 << (wave / WAVES));
    float weight = octave_gain * smoothstep(0.0, 1.0, (per_spacing / frequency - 2.0) * 0.5);
    float phase = (1.0 - coherence) * random_of(row.seed, RANDOM_WAVE_PHASES + wave);
    if (coherence > 0.0) {
      phase += coherence * coherent_phase(wave, row.seed, (styling.axes * vec4(strand_root, 1.0)).xyz, per_spread);
    }
    waves[wave] = weight * sine_and_cosine(phase).yx;
    if (wave % WAVES == WAVES - 1) {
      octave_gain *= gain;
    }
  }
  Walk walk;
  float s = 0.0;
  for (int i = 0; i < styling.point_count; i++) {
    if (i > 0) {
      s += segment_at(i).w;
    }
    vec2 noise = vec2(0.0);
    for (int first = 0; first < WAVES; first++) {
      vec2 angle = sine_and_cosine(frequencies[first] * s);
      float turns_left = (first % 2 == 1) ? -1.0 : 1.0;
      for (int wave = first; wave < WAVES * octave_count; wave += WAVES) {
        noise.x += waves[wave].x * angle.y - waves[wave].y * angle.x;
        noise.y += turns_left * (waves[wave].x * angle.x + waves[wave].y * angle.y);
        // The next octave has twice the angle.
        angle = vec2(2.0 * angle.x * angle.y, 1.0 - 2.0 * angle.x * angle.x);
      }
    }
    vec2 offset = noise * size * profile(course, s * per_total);
    if (i == 0) {
      walk = begin_across(first_frame(reference(centre_normal, styling.axes)), offset);
    }
    else {
      pass_across(walk, i, offset, row.numbers[1].w);
    }
  }
  end_across(row.numbers[1].w);
}
