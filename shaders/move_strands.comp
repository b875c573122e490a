// SPDX-License-Identifier: GPL-3.0-or-later
// Copies the points of some strands into the texture of all: changes by combing.

#include "include/strand.glsl"

void main()
{
  int place = int(gl_GlobalInvocationID.x);
  int moved = place / point_count;
  if (moved >= moved_count) {
    return;
  }
  int point = place - moved * point_count;
  // Each strand has one texel more than points: the first is its index.
  int strand = int(texelFetch(moved_strands, strand_texel(moved, 0, point_count + 1, moved_row_strands), 0).x);
  vec4 value = texelFetch(moved_strands, strand_texel(moved, point + 1, point_count + 1, moved_row_strands), 0);
  imageStore(strands, strand_texel(strand, point, point_count, row_strands), value);
}
