// SPDX-License-Identifier: GPL-3.0-or-later
// Where the history of a viewport is used: needs the sampler now_deviation.

#include "picture/history_blocks.glsl"

// Whether a block, or any block beside it, has noise: elsewhere the history would not reduce flicker.
bool has_noise(ivec2 block)
{
  vec4 noise = vec4(0.0);
  for (int turn = 0; turn < 4; turn++) {
    noise += textureLod(now_deviation, vec2(block + ivec2(turn & 1, turn >> 1)) / vec2(textureSize(now_deviation, 0)), 0.0);
  }
  return noise != vec4(0.0);
}
