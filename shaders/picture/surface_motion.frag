// SPDX-License-Identifier: GPL-3.0-or-later
// Motion vectors of a surface.

#include "picture/motion.glsl"

void main()
{
#if defined(HAS_PLACE_AFTER)
  vec4 after = place_after;
#else
  vec4 after = place_now;
#endif
  color = moved(place_now, place_before, after, motion.size.xy);
}
