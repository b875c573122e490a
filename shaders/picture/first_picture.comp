// SPDX-License-Identifier: GPL-3.0-or-later
// The first picture of a view, from a pass with one sample per pixel. A pixel's coverage is known from many lines through it,
// while its color is the mean of adjacent hair.

#include "visibility/covered_fraction.glsl"

const int REACH = 2;  // pixels: the color of hair varies less than its coverage

void main()
{
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, imageSize(first_picture)))) {
    return;
  }
  ivec2 place = pixel - first_place;
  ivec2 last = textureSize(picture, 0) - 1;
  vec4 total = vec4(0.0);
  if (all(greaterThanEqual(place, ivec2(0))) && all(lessThanEqual(place, last))) {
    uint bits = texelFetch(covered, place, 0).r;
    total = texelFetch(picture, place, 0);
    vec4 hair = vec4(0.0);
    vec2 shadow = vec2(0.0);  // of hair on surfaces: sum of alpha, and of weights
    // A loop without turns costs software drivers nothing, unlike a branch.
    int turns = (bits == 0u && total.a < 1.0) ? 0 : 25;
    for (int turn = 0; turn < turns; turn++) {
      ivec2 offset = ivec2(turn % 5, turn / 5) - REACH;
      vec4 beside = texelFetch(picture, clamp(place + offset, ivec2(0), last), 0);
      float part = float((REACH + 1 - abs(offset.x)) * (REACH + 1 - abs(offset.y)));
      if (beside.a == 1.0) {
        hair += part * beside;
      }
      else {
        // A shadow has edges where its surface ends.
        shadow += ((offset == ivec2(0)) ? 1e6 : part) * vec2(beside.a, 1.0);
      }
    }
    if (turns > 0) {
      float fraction = (hair.a > 0.0) ? covered_fraction(bits) : 0.0;
      total = hair * (fraction / max(hair.a, 1.0));
      total.a += (1.0 - fraction) * shadow.x / max(shadow.y, 1.0);
    }
  }
  imageStore(first_picture, pixel, total);
}
