// SPDX-License-Identifier: GPL-3.0-or-later
// Blocks of pixels, whose mean and deviation tell what has changed from what is noise.

const int BLOCK_SIDE = 8;

// Coordinates in a texture of blocks, from 0 to 1, of a place [pixels]; blocks: its size.
vec2 block_place(vec2 place, ivec2 blocks)
{
  return place / vec2(blocks * BLOCK_SIDE);
}
