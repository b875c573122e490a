// SPDX-License-Identifier: GPL-3.0-or-later
// Lookup of sigma_a in slices evenly spaced in its square root, and interpolation between them.

// (the slice below, the fraction to the next slice in sigma_a)
vec2 slice_of(float sigma_a, float low, float high, int slice_count)
{
  float step_size = max(high - low, 1e-6) / float(slice_count - 1);
  float below = clamp(floor((sqrt(sigma_a) - low) / step_size), 0.0, float(slice_count - 2));
  float root_below = low + step_size * below;
  // (root + step)² - root²
  float distance_to_next = step_size * (2.0 * root_below + step_size);
  return vec2(below, clamp((sigma_a - root_below * root_below) / distance_to_next, 0.0, 1.0));
}

// a^(1 - fraction) b^fraction; linear for very dark values, as either end may be black.
vec4 geometric_mix(vec4 a, vec4 b, float fraction)
{
  const float DARKEST = 1.0 / 16384.0;
  vec4 from = a + DARKEST;
  return from * pow((b + DARKEST) / from, vec4(fraction)) - DARKEST;
}
