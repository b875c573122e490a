// SPDX-License-Identifier: GPL-3.0-or-later
// Motion vectors of a surface.

#include "picture/motion.glsl"

void main()
{
  color = moved(place_now, place_before, place_after, motion.size.xy);
}
