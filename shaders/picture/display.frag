// SPDX-License-Identifier: GPL-3.0-or-later
// Hair over a viewport, after the view transform: applies the scene's color management.

#include "picture/display_transform.glsl"

// Depth of the hair in a pixel. Hair from an earlier picture may have no depth there: it gets the depth of adjacent hair, or
// else is in front, as surfaces in our picture occlude it already.
float depth_at(ivec2 pixel)
{
  float depth = texelFetch(depths, pixel, 0).r;
  for (int turn = 0; turn < 9 && depth == 1.0; turn++) {
    ivec2 beside = pixel + ivec2(turn % 3 - 1, turn / 3 - 1);
    depth = texelFetch(depths, clamp(beside, ivec2(0), textureSize(depths, 0) - 1), 0).r;
  }
  return (depth < 1.0) ? depth : 0.0;
}

void main()
{
  vec2 place = gl_FragCoord.xy - origin;
  if (any(lessThan(place, border.xy)) || any(greaterThan(place, border.zw))) {
    discard;
  }
  ivec2 pixel = ivec2(place);
  vec4 light = texelFetch(passes, pixel, 0);
  if (first_part > 0.0) {
    light = mix(light, float(pass_count) * texelFetch(first_picture, pixel, 0), first_part);
  }
  light = max(light, vec4(0.0));
  if (light.a == 0.0) {
    discard;
  }
  float side = float(textureSize(display_table, 0).x);
  vec3 at = display_place(exposure * light.rgb / light.a);
  vec3 display = textureLod(display_table, (at * (side - 1.0) + 0.5) / side, 0.0).rgb;
  // Blender interprets colors drawn over a viewport as display colors to the power of 2.2, for any display encoding.
  color = vec4(pow(display, vec3(2.2)), 1.0) * (opacity * min(light.a / float(pass_count), 1.0));
  gl_FragDepth = depth_at(pixel);
}
