// SPDX-License-Identifier: GPL-3.0-or-later
// Writes the points of combed strands into the texture of all strands.

#include "strands/strip.glsl"

void main()
{
  int group = int(gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x);
  int place = group * int(gl_WorkGroupSize.x) + int(gl_LocalInvocationID.x);
  int moved = place / texel_count;
  if (moved >= moved_count) {
    return;
  }
  int texel = place - moved * texel_count;
  // Each moved strand has an extra first texel: its index.
  ivec2 there = strand_texel(moved, 0, texel_count + 1, moved_row_strands);
  int strand = int(texelFetch(moved_strands, there, 0).x);
  ivec2 here = strand_texel(strand, texel, texel_count, row_strands);
  imageStore(strands, here, texelFetch(moved_strands, there + ivec2(1 + texel, 0), 0));
  if (texel == 0) {
    imageStore(moved_rows, ivec2(strand % row_strands, strand / row_strands), vec4(float(moved + 1)));
  }
}
