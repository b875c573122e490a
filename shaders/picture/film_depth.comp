// SPDX-License-Identifier: GPL-3.0-or-later
// Data passes: the weight of samples in which hair is nearest, the least distance along the view axis, and the weight of
// samples other than background.

#include "picture/film_filter.glsl"
#include "picture/sample_distance.glsl"
#include "visibility/sample_values.glsl"

void main()
{
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, imageSize(sums)))) {
    return;
  }
  vec4 found = imageLoad(sums, pixel);
  for (int y = 0; y < tap_count(); y++) {
    for (int x = 0; x < tap_count(); x++) {
      ivec2 tap = ivec2(x, y);
      ivec2 place = sample_place(pixel, tap);
      float depth = uintBitsToFloat(texelFetch(depths, place, 0).r);
      if (texelFetch(segments, place, 0).r < NO_SEGMENT) {
        found.x += filter_weight(tap);
      }
      if (depth < 1.0) {
        found.z += filter_weight(tap);
        found.y = is_in_pixel(tap) ? min(found.y, distance_at(depth, view_to_clip)) : found.y;
      }
    }
  }
  imageStore(sums, pixel, found);
}
