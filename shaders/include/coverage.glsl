// SPDX-License-Identifier: GPL-3.0-or-later
// Where samples look at strands: those of thin strands away from their centers, so that no strand is ever widened.

// Offsets come from a sequence along four columns, moved at random from one part of four by four samples to the next: a
// longer one shows patterns along strands of a few slopes, which it meets at the same offset again and again.
const int OFFSET_PART_BITS = 2;

// Random number in [0, 1) of two integers.
float random_of_part(ivec2 part)
{
  uint bits = uint(part.x) * 1597334677u ^ uint(part.y) * 3812015801u;
  bits = (bits ^ (bits >> 15u)) * 747796405u;
  return float(bits >> 8u) / 16777216.0;
}

// Offset in [-0.5, 0.5), across a column, of its samples beside the axis of a strand. Strands beside each other have the
// same one: what they cover together is then that of the picture's area [Cook86]. It is one number for the whole column of a
// strand, so that the samples that it covers are found without trying any. A low-discrepancy sequence [Roberts18] gives less
// noise than random numbers. column, middle: of the whole picture, and where the axis is in it; turn: of the pass.
float sample_offset(int column, float middle, float turn)
{
  ivec2 part = ivec2(column, int(floor(middle))) >> OFFSET_PART_BITS;
  float within = float(column & ((1 << OFFSET_PART_BITS) - 1));
  return fract(random_of_part(part) + turn + 0.61803399 * within) - 0.5;
}

// How much of that offset samples take from strands of a half width [samples]: wide strands have smooth edges without it.
float offset_share(float half_width)
{
  return clamp(1.5 - 2.0 * half_width, 0.0, 1.0);
}
