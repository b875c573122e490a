// SPDX-License-Identifier: GPL-3.0-or-later
// Writes a strand in single precision for subsequent styles, in place of strands/write_packed_strand.glsl. Needs the image
// strands.

#include "strands/strip.glsl"

ivec2 put_first;
vec3 put_root;

void begin_strand(int strand, vec3 root, float range, int point_count, int row_strands)
{
  put_first = strand_texel(strand, 0, point_count, row_strands);
  put_root = root;
  imageStore(strands, put_first, vec4(root, 0.0));
}

void put_point(int point, vec3 offset)
{
  imageStore(strands, put_first + ivec2(point, 0), vec4(put_root + offset, 0.0));
}

void end_strand(int strand)
{
}
