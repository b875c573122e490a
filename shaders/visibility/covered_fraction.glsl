// SPDX-License-Identifier: GPL-3.0-or-later

// Fraction of a sample that strands cover, from the bits of visibility/covered_parts.glsl: flat and steep strands overlap at
// random.
float covered_fraction(uint bits)
{
  vec2 lines = vec2(bitCount(bits & 0xFFFFu), bitCount(bits >> 16u));
  vec2 left = 1.0 - lines / 16.0;
  return 1.0 - left.x * left.y;
}
