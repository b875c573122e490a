// SPDX-License-Identifier: GPL-3.0-or-later
// The first picture of a view, from a pass with one sample per pixel. A pixel's coverage is known from many lines through it,
// while its color is the mean of adjacent hair.

#include "visibility/covered_fraction.glsl"

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
    int rows = (bits == 0u && total.a < 1.0) ? -1 : int(color_radius);
    for (int y = -rows; y <= rows; y++) {
      int columns = int(sqrt(color_radius * color_radius - float(y * y)));
      for (int x = -columns; x <= columns; x++) {
        vec4 beside = texelFetch(picture, clamp(place + ivec2(x, y), ivec2(0), last), 0);
        float part = color_radius * color_radius - float(x * x + y * y);
        if (beside.a == 1.0) {
          hair += part * beside;
        }
        else {
          // A shadow has edges where its surface ends.
          shadow += ((x == 0 && y == 0) ? 1e6 : part) * vec2(beside.a, 1.0);
        }
      }
    }
    if (rows >= 0) {
      float fraction = (hair.a > 0.0) ? covered_fraction(bits) : 0.0;
      total = hair * (fraction / max(hair.a, 1e-6));
      total.a += (1.0 - fraction) * shadow.x / max(shadow.y, 1e-6);
    }
  }
  imageStore(first_picture, pixel, total);
}
