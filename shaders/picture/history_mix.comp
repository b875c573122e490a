// SPDX-License-Identifier: GPL-3.0-or-later
// The shown picture of a viewport during refinement: the mean of the passes so far, blended with the reprojected history,
// whose weight in passes decreases to zero.

const float MOST_LIGHT = 6e4;  // within the range of half floats

void main()
{
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, imageSize(colors)))) {
    return;
  }
  float worth = part_left * texelFetch(carried_passes, pixel, 0).r;
  float passes = pass_count + worth;
  vec4 light = mix(texelFetch(sums, pixel, 0) / weight, texelFetch(carried, pixel, 0), worth / passes);
  // Infinite values would stay in the history and spread.
  imageStore(colors, pixel, clamp(light, -MOST_LIGHT, MOST_LIGHT));
  imageStore(weights, pixel, vec4(passes));
}
