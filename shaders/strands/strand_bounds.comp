// SPDX-License-Identifier: GPL-3.0-or-later
// Joins bounding boxes, `share` neighbors into one, for strands whose points are only on the GPU.

#include "strands/strip.glsl"

void main()
{
  int box = int(gl_GlobalInvocationID.x);
  if (box >= joined_count) {
    return;
  }
  int first = box * share;
  int last = min(first + share, box_count) - 1;
  int row_boxes = textureSize(boxes, 0).x / 2;
  ivec2 texel = strand_texel(first, 0, 2, row_boxes);
  vec4 least = texelFetch(boxes, texel, 0);
  vec4 greatest = texelFetch(boxes, texel + ivec2(1, 0), 0);
  for (int one = first + 1; one <= last; one++) {
    texel = strand_texel(one, 0, 2, row_boxes);
    least = min(least, texelFetch(boxes, texel, 0));
    greatest = max(greatest, texelFetch(boxes, texel + ivec2(1, 0), 0));
  }
  ivec2 there = strand_texel(box, 0, 2, imageSize(joined).x / 2);
  imageStore(joined, there, least);
  imageStore(joined, there + ivec2(1, 0), greatest);
}
