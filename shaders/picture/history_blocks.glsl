// SPDX-License-Identifier: GPL-3.0-or-later
// Blocks of pixels, whose mean and deviation distinguish changes from noise.

const int BLOCK_SIDE = 8;

// A position [pixels] → coordinates from 0 to 1 in a texture of blocks; blocks: its size.
vec2 block_place(vec2 place, ivec2 blocks)
{
  return place / vec2(blocks * BLOCK_SIDE);
}
