// SPDX-License-Identifier: GPL-3.0-or-later
// Strands thinner than a sample are drawn one sample wide and omitted from samples according to their coverage.

// Random offset in [0, 1] of a strand's dashes [Wyman17], uncorrelated between neighbouring strands.
float strand_offset(int strand)
{
  uint bits = uint(strand) * 747796405u + 2891336453u;
  bits = ((bits >> ((bits >> 28u) + 4u)) ^ bits) * 277803737u;
  return float(((bits >> 22u) ^ bits) >> 8u) / 16777216.0;
}

// Whether a strand that covers the part `coverage` of its width is drawn in a sample. The samples that it crosses use
// a low-discrepancy sequence [Roberts18], which gives less noise than random numbers. offset: of the strand,
// plus that of the pass.
bool is_covered(float offset, ivec2 sample_place, float coverage)
{
  vec2 steps = vec2(0.75487767, 0.56984029) * vec2(sample_place & 1023);
  return fract(offset + steps.x + steps.y) < coverage;
}
