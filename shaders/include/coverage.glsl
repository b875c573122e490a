// SPDX-License-Identifier: GPL-3.0-or-later
// Strands thinner than a sample are drawn one sample wide and left out of as many samples as keeps their brightness.

// Where a strand of its own, from 0 to 1, starts its dashes [Wyman17]: neighbouring strands have nothing in common.
float strand_offset(int strand)
{
  uint bits = uint(strand) * 747796405u + 2891336453u;
  bits = ((bits >> ((bits >> 28u) + 4u)) ^ bits) * 277803737u;
  return float(((bits >> 22u) ^ bits) >> 8u) / 16777216.0;
}

// Whether a strand that covers the part `coverage` of its width shows in a sample. The samples that it crosses meet the
// points of an even sequence [Roberts18]: of any few in a row just its part is taken, with less noise than by chance.
// offset: of the strand, plus what makes a pass take others.
bool is_covered(float offset, ivec2 sample_place, float coverage)
{
  vec2 steps = vec2(0.75487767, 0.56984029) * vec2(sample_place & 1023);
  return fract(offset + steps.x + steps.y) < coverage;
}
