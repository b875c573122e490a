// SPDX-License-Identifier: GPL-3.0-or-later
// Exchanges the points of some strands with those in the texture of all: changes by combing. Where they were before is
// left for motion vectors.

#include "include/strand.glsl"

void main()
{
  int group = int(gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x);
  int place = group * int(gl_WorkGroupSize.x) + int(gl_LocalInvocationID.x);
  int moved = place / texel_count;
  if (moved >= moved_count) {
    return;
  }
  int texel = place - moved * texel_count;
  // Each strand has one texel more: the first is its index.
  int strand = int(imageLoad(moved_strands, strand_texel(moved, 0, texel_count + 1, moved_row_strands)).x);
  ivec2 there = strand_texel(moved, texel + 1, texel_count + 1, moved_row_strands);
  ivec2 here = strand_texel(strand, texel, texel_count, row_strands);
  vec4 after = imageLoad(moved_strands, there);
  imageStore(moved_strands, there, imageLoad(strands, here));
  imageStore(strands, here, after);
  if (texel == 0) {
    imageStore(moved_rows, ivec2(strand % row_strands, strand / row_strands), vec4(float(moved + 1)));
  }
}
