// SPDX-License-Identifier: GPL-3.0-or-later
// The sample with the nearest geometry in or beside each pixel, so that silhouettes move with their objects: its index in the
// textures of samples, row by row; 0 where no history is used.

#include "picture/history_noise.glsl"

// Origin of the textures of samples in the picture. There is no hair outside of them.
ivec2 first_place()
{
  return ivec2(history.first_column, history.first_row);
}

void look(ivec2 place, inout ivec2 nearest_place, inout float nearest)
{
  place = clamp(place, ivec2(0), textureSize(depths, 0) - 1);
  float depth = uintBitsToFloat(texelFetch(depths, place, 0).r);
  if (depth < nearest) {
    nearest = depth;
    nearest_place = place;
  }
}

ivec2 place_near(ivec2 pixel)
{
  int side = history.samples_per_side;
  ivec2 corner = pixel * side - first_place();
  ivec2 nearest_place = ivec2(0);
  float nearest = 2.0;
  for (int y = 0; y < side; y++) {
    for (int x = 0; x < side; x++) {
      look(corner + ivec2(x, y), nearest_place, nearest);
    }
  }
  look(corner + ivec2(side, 0), nearest_place, nearest);
  look(corner + ivec2(-1, 0), nearest_place, nearest);
  look(corner + ivec2(0, side), nearest_place, nearest);
  look(corner + ivec2(0, -1), nearest_place, nearest);
  // A thin strand is in few samples: in front of the background, the search radius is larger.
  if (nearest == 1.0) {
    for (int turn = 0; turn < 4; turn++) {
      int sign = (turn & 2) - 1;
      look(corner + ivec2(2 * sign * side, 2 * side * (2 * (turn & 1) - 1)), nearest_place, nearest);
      look(corner + ((turn & 1) == 0 ? ivec2(4 * sign * side, 0) : ivec2(0, 4 * sign * side)), nearest_place, nearest);
    }
  }
  return nearest_place;
}

void main()
{
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, imageSize(places)))) {
    return;
  }
  ivec2 place = has_noise(pixel / BLOCK_SIDE) ? place_near(pixel) : ivec2(0);
  imageStore(places, pixel, uvec4(uint(place.y * textureSize(depths, 0).x + place.x)));
}
