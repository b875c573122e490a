// SPDX-License-Identifier: GPL-3.0-or-later
// Jitter of samples for thin strands, so that strands are never widened.

// Blocks of 4 × 4 samples have offsets from a lattice, shifted randomly for each block: a larger lattice shows patterns along
// strands of some slopes, as they repeat the same offset.
const int OFFSET_BITS = 2;

// Offset in [-0.5, 0.5), along a column, of its samples around the axis of a strand: a single number for the column, so that
// covered samples are found without a search. Strands whose axes are in the same row have the same offset, so that their
// combined coverage is unbiased [Cook86]. A low-discrepancy lattice [Roberts18] has less noise than random numbers. column,
// middle: column of the whole picture, and position of the axis in it; turn: from `offset_turn`. GPUs convert between
// integers and floats at an eighth of the speed of arithmetic, so most operations are on bits.
float sample_offset(int column, float middle, uint turn)
{
  ivec2 place = ivec2(column, int(floor(middle)));
  uvec2 part = uvec2(place >> OFFSET_BITS);
  uvec2 within = uvec2(place & ((1 << OFFSET_BITS) - 1));
  uint bits = part.x * 1597334677u ^ part.y * 3812015801u;
  bits = (bits ^ (bits >> 15u)) * 747796405u;
  bits += turn + within.x * 3242174889u + within.y * 2447445414u;
  return uintBitsToFloat(0x3F800000u | (bits >> 9u)) - 1.5;
}

// The turn of a pass, from 0 to 1 → fixed point with 2^32 as 1.
uint offset_turn(float turn)
{
  return uint(fract(turn) * 16777216.0) << 8u;
}

// Fraction of that offset for strands of a half width [samples]: wide strands have smooth edges without it.
float offset_share(float half_width)
{
  return clamp(1.5 - 2.0 * half_width, 0.0, 1.0);
}
