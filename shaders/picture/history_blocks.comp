// SPDX-License-Identifier: GPL-3.0-or-later
// Mean and standard deviation of each block of pixels; exactly zero for a uniform block.

#include "picture/history_blocks.glsl"

void main()
{
  ivec2 block = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(block, imageSize(means)))) {
    return;
  }
  ivec2 corner = block * BLOCK_SIDE;
  ivec2 end = min(corner + BLOCK_SIDE, textureSize(picture, 0));
  vec4 sum = vec4(0.0);
  vec4 squares = vec4(0.0);
  for (int y = corner.y; y < end.y; y++) {
    for (int x = corner.x; x < end.x; x++) {
      // A single bright sample is not a change.
      vec4 light = clamp(texelFetch(picture, ivec2(x, y), 0) / weight, -100.0, 100.0);
      sum += light;
      squares += light * light;
    }
  }
  vec2 extent = vec2(end - corner);
  float count = extent.x * extent.y;
  vec4 mean = sum / count;
  vec4 deviation = sqrt(max(squares / count - mean * mean, vec4(0.0)));
  // Smaller deviations are rounding, not noise.
  imageStore(means, block, mean);
  imageStore(deviations, block, deviation * step(1e-3 * abs(mean) + 1e-6, deviation));
}
