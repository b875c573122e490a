// SPDX-License-Identifier: GPL-3.0-or-later
// Guides as antialiased lines of constant width in one color, each in its own, or in a hue that is given. Frozen points
// are faded.

#include "visibility/unclipped.glsl"

const float FRINGE_OPACITY = 0.35;  // of a dark pixel along both sides, for light hair
const float FROZEN_OPACITY = 0.25;  // of frozen points

// 1 at a frozen point of a guide, 0 at others; guides have `frozen_places` texels each.
float frozen_at(int place)
{
  int texel = strand_index * frozen_places + place;
  int width = textureSize(frozen, 0).x;
  return texelFetch(frozen, ivec2(texel % width, texel / width), 0).r;
}

float frozen_part()
{
  if (frozen_places == 0) {
    return 0.0;
  }
  float along = strand_place / float(max(view.drawn_points - 1, 1)) * float(frozen_places - 1);
  int below = clamp(int(along), 0, frozen_places - 2);
  return mix(frozen_at(below), frozen_at(below + 1), clamp(along - float(below), 0.0, 1.0));
}

vec3 hue(float turn)
{
  return clamp(abs(fract(turn + vec3(0.0, 2.0 / 3.0, 1.0 / 3.0)) * 6.0 - 3.0) - 1.0, 0.0, 1.0);
}

// The color of a guide. A hue in `hues` below zero stands for the common color.
vec3 color_of_guide()
{
  if (color_source == 0) {
    return line_color.rgb;
  }
  // Steps of the golden ratio give neighboring indices distinct hues.
  float turn = float(strand_index) * 0.61803399;
  if (color_source == 2) {
    int width = textureSize(hues, 0).x;
    turn = texelFetch(hues, ivec2(strand_index % width, strand_index / width), 0).r;
    if (turn < 0.0) {
      return line_color.rgb;
    }
  }
  return mix(vec3(1.0), hue(fract(turn)), 0.75);
}

void main()
{
  if (IS_CLIPPED && is_cut_off(drawn_position)) {
    discard;
  }
  float away = 0.5 * strip_width * abs(strand_side_place);  // from the axis [pixels]
  float half_line = 0.5 * strip_width - 1.0;
  float line = clamp(half_line - away, 0.0, 1.0);
  float fringe = FRINGE_OPACITY * clamp(half_line + 1.0 - away, 0.0, 1.0);
  float coverage = line + (1.0 - line) * fringe;
  float shown = line / max(coverage, 1e-6);  // the part that is not dark
  coverage *= mix(1.0, FROZEN_OPACITY, frozen_part());
  color = vec4(color_of_guide() * shown, coverage * line_color.a);
}
