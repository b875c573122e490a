// SPDX-License-Identifier: GPL-3.0-or-later
// Adds a pass, with several samples per pixel, to the weighted sum of all samples. The tile has a margin around it.

#include "picture/film_filter.glsl"

void main()
{
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, imageSize(sums)))) {
    return;
  }
  vec4 total = imageLoad(sums, pixel);
  for (int y = 0; y < tap_count(); y++) {
    for (int x = 0; x < tap_count(); x++) {
      ivec2 tap = ivec2(x, y);
      total += filter_weight(tap) * texelFetch(picture, sample_place(pixel, tap), 0);
    }
  }
  imageStore(sums, pixel, total);
}
