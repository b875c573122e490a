// SPDX-License-Identifier: GPL-3.0-or-later
// Where surfaces are about to be shaded: the background, and depths that leave out what hair or another surface hides.

#include "include/no_segment.glsl"

// By how much of the depth range surfaces may be farther than they were drawn at first: more than rounding, so that none
// hides itself.
const float FARTHER = 5e-6;

void main()
{
  ivec2 place = ivec2(gl_FragCoord.xy);
  color = background;
  bool is_hair = texelFetch(segments, place, 0).r < NO_SEGMENT;
  gl_FragDepth = is_hair ? 0.0 : min(texelFetch(surface_depth, place, 0).r + FARTHER, 1.0);
}
