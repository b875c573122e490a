// SPDX-License-Identifier: GPL-3.0-or-later
// A line around hair that is selected: pixels that hair covers less than half, beside one that it covers more.

// The part of a pixel that hair covers; none outside the picture.
float coverage(ivec2 pixel)
{
  bool is_inside = all(greaterThanEqual(pixel, ivec2(0))) && all(lessThan(pixel, textureSize(passes, 0)));
  return is_inside ? texelFetch(passes, pixel, 0).a / float(pass_count) : 0.0;
}

const int REACH = 2;  // pixels

// Whether a segment of the selected hair is seen around a pixel: one pass may miss a thin strand.
bool is_selected(ivec2 pixel)
{
  ivec2 corner = (pixel - REACH) * samples_per_side;
  int side = (2 * REACH + 1) * samples_per_side;
  for (int i = 0; i < side * side; i++) {
    ivec2 place = corner + ivec2(i % side, i / side);
    int index = int(texelFetch(segments, clamp(place, ivec2(0), textureSize(segments, 0) - 1), 0).r) - first_segment;
    if (index >= 0 && index < segment_count) {
      return true;
    }
  }
  return false;
}

void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy - origin);
  if (coverage(pixel) >= 0.5) {
    discard;
  }
  for (int side = 0; side < 4; side++) {
    ivec2 beside = pixel + ((side < 2) ? ivec2(2 * side - 1, 0) : ivec2(0, 2 * side - 5));
    if (coverage(beside) >= 0.5 && is_selected(beside)) {
      color = vec4(outline_color, 1.0);
      gl_FragDepth = texelFetch(depths, beside, 0).r;
      return;
    }
  }
  discard;
}
