// SPDX-License-Identifier: GPL-3.0-or-later
// The report's locator: each guide in its own color.

#include "visibility/unclipped.glsl"

vec3 hue(float turn)
{
  return clamp(abs(fract(turn + vec3(0.0, 2.0 / 3.0, 1.0 / 3.0)) * 6.0 - 3.0) - 1.0, 0.0, 1.0);
}

void main()
{
  if (IS_CLIPPED && is_cut_off(drawn_position)) {
    discard;
  }
  // Steps of the golden ratio give neighboring indices distinct hues.
  color = vec4(mix(vec3(1.0), hue(fract(float(strand_index) * 0.61803399)), 0.75), 1.0);
}
