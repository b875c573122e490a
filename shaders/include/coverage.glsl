// SPDX-License-Identifier: GPL-3.0-or-later
// Where samples look at strands: those of thin strands away from their centers, so that no strand is ever widened.

// Tiles of 4 × 4 samples have offsets from a lattice, moved at random from tile to tile: a larger one shows patterns along
// strands of a few slopes, which it meets at the same offset again and again.
const int OFFSET_TILE_BITS = 2;

// Random number in [0, 1) of two integers.
float random_of_tile(ivec2 tile)
{
  uint bits = (uint(tile.x) * 1597334677u ^ uint(tile.y) * 3812015801u) * 747796405u + 2891336453u;
  bits = ((bits >> ((bits >> 28u) + 4u)) ^ bits) * 277803737u;
  return float(((bits >> 22u) ^ bits) >> 8u) / 16777216.0;
}

// Offset in [-0.5, 0.5) of a sample from its center, the same for all strands: what they cover together is then that of
// the picture's area [Cook86]. A low-discrepancy sequence [Roberts18] gives less noise than random numbers. turn: of the
// pass.
float sample_offset(ivec2 sample_place, float turn)
{
  ivec2 within = sample_place & ((1 << OFFSET_TILE_BITS) - 1);
  vec2 steps = vec2(0.75487767, 0.56984029) * vec2(within);
  return fract(random_of_tile(sample_place >> OFFSET_TILE_BITS) + turn + steps.x + steps.y) - 0.5;
}

// How much of that offset samples take from strands of a half width [samples]: wide strands have smooth edges without it.
float offset_share(float half_width)
{
  return clamp(1.5 - 2.0 * half_width, 0.0, 1.0);
}
