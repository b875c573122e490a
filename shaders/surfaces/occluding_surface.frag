// SPDX-License-Identifier: GPL-3.0-or-later
// A surface drawn by Blender, which only occludes the hair behind it here.

#include "visibility/unclipped.glsl"

void main()
{
  if (IS_CLIPPED && is_cut_off(drawn_position)) {
    discard;
  }
  color = vec4(0.0);
}
