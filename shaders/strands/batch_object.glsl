// SPDX-License-Identifier: GPL-3.0-or-later
// The hair object of a thread among linked objects, which share strands and look. `view` is a variable here: the block of
// strands/shared_view.glsl with the numbers of the object, from a row of the texture `objects`, which
// hair_addon/blender/gpu/strand_batches.py fills. Programs for linked objects include this file first.

View view;
int first_run;  // of the object, in `seen_runs`
int object_row;  // of the object, in the texture `objects`
int object_layer;  // of the object, in the textures of the world's visibility; or its map among those drawn together

const int NUMBER_TEXEL = 8;
const int SEGMENT_TEXEL = 9;
const int RUN_TEXEL = 10;
const int GROUP_TEXEL = 11;
const int TINT_TEXEL = 12;

vec4 object_texel(int row, int texel)
{
  return texelFetch(objects, ivec2(texel, row), 0);
}

mat4 object_matrix(int row, int texel)
{
  return mat4(object_texel(row, texel),
              object_texel(row, texel + 1),
              object_texel(row, texel + 2),
              object_texel(row, texel + 3));
}

// An integer from its upper and lower 16 bits: single precision has 24.
int whole_number(vec2 parts)
{
  return int(parts.x) * 65536 + int(parts.y);
}

#include "strands/shared_view.glsl"

void choose_object(int row)
{
  object_row = row;
  vec4 segments = object_texel(row, SEGMENT_TEXEL);
  object_layer = int(segments.z);
  view = view_of_layer(object_layer);
  view.object_to_world = object_matrix(row, 0);
  view.object_to_clip = object_matrix(row, 4);
  vec4 numbers = object_texel(row, NUMBER_TEXEL);
  view.drawn_points = int(numbers.x);
  view.drawn_strands = int(numbers.y);
  view.object_scale = numbers.z;
  view.thickness = numbers.w;
  view.first_segment = whole_number(segments.xy);
  first_run = whole_number(object_texel(row, RUN_TEXEL).xy);
}
