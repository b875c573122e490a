// SPDX-License-Identifier: GPL-3.0-or-later
// Copies strands that are about to change, for motion vectors: all strands, or those in a list.

#include "strands/strip.glsl"

void main()
{
  int group = int(gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x);
  int place = group * int(gl_WorkGroupSize.x) + int(gl_LocalInvocationID.x);
  int kept = place / texel_count;
  if (kept >= kept_count) {
    return;
  }
  int texel = place - kept * texel_count;
  // Each copied strand has an extra first texel: its index, if there is a list.
  ivec2 there = strand_texel(kept, 0, texel_count + 1, row_kept);
  int strand = (is_list != 0) ? int(texelFetch(listed, there, 0).x) : kept;
  ivec2 here = strand_texel(strand, texel, texel_count, row_strands);
  imageStore(kept_strands, there + ivec2(1 + texel, 0), texelFetch(strands, here, 0));
}
