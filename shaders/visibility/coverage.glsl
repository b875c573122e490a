// SPDX-License-Identifier: GPL-3.0-or-later
// Where samples look at strands: those of thin strands away from their centers, so that no strand is ever widened.

// Parts of 4 × 4 samples have offsets from a lattice, moved at random from part to part: a larger one shows patterns along
// strands of a few slopes, which it meets at the same offset again and again.
const int OFFSET_BITS = 2;

// Offset in [-0.5, 0.5), across a column, of its samples beside the axis of a strand: one number for the whole column, so
// that the samples that it covers are found without trying any. Strands whose axes are in one row have the same one: what
// they cover together is then that of the picture's area [Cook86]. A low-discrepancy lattice [Roberts18] gives less noise
// than random numbers. column, middle: of the whole picture, and where the axis is in it; turn: of `offset_turn`. Graphics
// hardware converts integers and floats at an eighth of the speed of arithmetic, so that most of it is in bits.
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

// The turn of a pass, from 0 to 1, as a part of 2^32.
uint offset_turn(float turn)
{
  return uint(fract(turn) * 16777216.0) << 8u;
}

// How much of that offset samples take from strands of a half width [samples]: wide strands have smooth edges without it.
float offset_share(float half_width)
{
  return clamp(1.5 - 2.0 * half_width, 0.0, 1.0);
}
