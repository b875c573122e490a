// SPDX-License-Identifier: GPL-3.0-or-later
// The position of the nearest sample in each pixel, and its distance along the view axis. Of samples that are about as near,
// the one in the middle of the pixel counts.

#include "picture/film_filter.glsl"
#include "picture/sample_distance.glsl"

const float NEARER = 0.999;  // distance of a nearer sample relative to another

void main()
{
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, imageSize(sums)))) {
    return;
  }
  vec4 found = imageLoad(sums, pixel);
  for (int index = 0; index < samples_per_side * samples_per_side; index++) {
    ivec2 from_middle = ivec2(index % samples_per_side, index / samples_per_side);
    ivec2 tap = (from_middle + samples_per_side / 2) % samples_per_side + margin;
    ivec2 place = sample_place(pixel, tap);
    vec4 position = texelFetch(picture, place, 0);
    float reach = distance_at(uintBitsToFloat(texelFetch(depths, place, 0).r), view_to_clip);
    if (position.a > 0.0 && reach < NEARER * found.w) {
      found = vec4(position.xyz, reach);
    }
  }
  imageStore(sums, pixel, found);
}
