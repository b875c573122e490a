// SPDX-License-Identifier: GPL-3.0-or-later
// How far a surface moves in a picture.

#include "include/motion.glsl"

void main()
{
  color = moved(place_now, place_before, place_after, motion.size.xy);
}
