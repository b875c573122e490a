// SPDX-License-Identifier: GPL-3.0-or-later
// Each block of the picture as two triangles. Blocks without noise in and beside them have no area, as the history would not
// reduce flicker.

#include "picture/history_blocks.glsl"

void main()
{
  ivec2 blocks = textureSize(now_deviation, 0);
  int block = gl_VertexID / 6;
  vec2 place = vec2(block % blocks.x, block / blocks.x);
  vec4 noise = vec4(0.0);
  for (int turn = 0; turn < 4; turn++) {
    noise += textureLod(now_deviation, (place + vec2(turn & 1, turn >> 1)) / vec2(blocks), 0.0);
  }
  int turn = gl_VertexID - 6 * block;
  int corner = (turn < 3) ? turn : ((turn < 5) ? 5 - turn : 3);
  vec2 at = (place + vec2(corner & 1, corner >> 1)) * float(BLOCK_SIDE) / history.size.xy;
  gl_Position = (noise == vec4(0.0)) ? vec4(0.0, 0.0, 0.0, 1.0) : vec4(2.0 * at - 1.0, 0.0, 1.0);
}
