// SPDX-License-Identifier: GPL-3.0-or-later
// The distance [pixels] from each pixel to the nearest hair in its row: active hair in red, other selected hair in green.

#include "picture/outline.glsl"

void main()
{
  ivec2 here = ivec2(gl_FragCoord.xy);
  ivec2 last = textureSize(mask, 0) - 1;
  vec2 nearest = vec2(NO_HAIR);
  for (int tap = -reach; tap <= reach; tap++) {
    vec2 coverage = texelFetch(mask, clamp(here + ivec2(tap, 0), ivec2(0), last), 0).rg / float(pass_count);
    float offset = abs(float(tap));
    nearest = min(nearest, vec2(distance_to_covered(offset, coverage.r), distance_to_covered(offset, coverage.g)));
  }
  color = vec4(nearest, 0.0, 1.0);
}
