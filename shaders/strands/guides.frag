// SPDX-License-Identifier: GPL-3.0-or-later
// Guides as antialiased lines of constant width in one color, or each in its own, as the report's locator.

#include "visibility/unclipped.glsl"

const float FRINGE_OPACITY = 0.35;  // of a dark pixel along both sides, for light hair

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
  vec3 own = mix(vec3(1.0), hue(fract(float(strand_index) * 0.61803399)), 0.75);
  float away = 0.5 * strip_width * abs(strand_side_place);  // from the axis [pixels]
  float half_line = 0.5 * strip_width - 1.0;
  float line = clamp(half_line - away, 0.0, 1.0);
  float fringe = FRINGE_OPACITY * clamp(half_line + 1.0 - away, 0.0, 1.0);
  float coverage = line + (1.0 - line) * fringe;
  color = vec4((is_own_color != 0 ? own : line_color.rgb) * (line / max(coverage, 1e-6)), coverage * line_color.a);
}
