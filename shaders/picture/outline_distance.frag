// SPDX-License-Identifier: GPL-3.0-or-later
// The distance [pixels] from each pixel to the nearest hair: active hair in red, other selected hair in green. Blue and
// alpha: the visible fraction of that hair around the pixel.

#include "picture/outline.glsl"

void main()
{
  ivec2 here = ivec2(gl_FragCoord.xy);
  ivec2 last = textureSize(mask, 0) - 1;
  vec2 nearest = vec2(NO_HAIR);
  for (int tap = -reach; tap <= reach; tap++) {
    vec2 in_row = texelFetch(rows, clamp(here + ivec2(0, tap), ivec2(0), last), 0).rg;
    nearest = min(nearest, sqrt(in_row * in_row + float(tap * tap)));
  }
  vec4 around = vec4(0.0);
  if (min(nearest.r, nearest.g) <= float(reach)) {
    for (int y = -reach; y <= reach; y++) {
      for (int x = -reach; x <= reach; x++) {
        around += texelFetch(mask, clamp(here + ivec2(x, y), ivec2(0), last), 0);
      }
    }
  }
  color = vec4(nearest, clamp(around.ba / max(around.rg, vec2(1e-6)), 0.0, 1.0));
}
