// SPDX-License-Identifier: GPL-3.0-or-later
// Writes a strand for drawing, eight bytes per point, and its bounding box: needs the images strands and boxes.

#include "strands/packed_strand.glsl"

ivec2 put_first;
vec3 put_root;
float put_range;
vec3 put_least;
vec3 put_greatest;

// range: maximum of any offset's coordinates; row_strands: whole strands per row of the texture.
void begin_strand(int strand, vec3 root, float range, int point_count, int row_strands)
{
  put_first = packed_first(strand, 0, point_count, row_strands);
  imageStore(strands, put_first, vec4(root.xy, 0.0, 0.0));
  imageStore(strands, put_first + ivec2(1, 0), vec4(root.z, range, 0.0, 0.0));
  put_root = root;
  put_range = range;
  put_least = root;
  put_greatest = root;
}

// point: not the root.
void put_point(int point, vec3 offset)
{
  imageStore(strands, put_first + ivec2(HEAD_TEXELS - 1 + point, 0), vec4(packed_offset(offset, put_range), 0.0, 0.0));
  put_least = min(put_least, put_root + offset);
  put_greatest = max(put_greatest, put_root + offset);
}

void end_strand(int strand)
{
  ivec2 box = strand_texel(strand, 0, 2, imageSize(boxes).x / 2);
  imageStore(boxes, box, vec4(put_least, 0.0));
  imageStore(boxes, box + ivec2(1, 0), vec4(put_greatest, 0.0));
}
