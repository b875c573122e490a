// SPDX-License-Identifier: GPL-3.0-or-later
// A pass over a picture, several samples a pixel, joins the weighted sum of all samples. Around the tile lies a margin.

#include "include/film_filter.glsl"

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
      total += filter_weight(tap) * texelFetch(picture, pixel * samples_per_side + tap, 0);
    }
  }
  imageStore(sums, pixel, total);
}
