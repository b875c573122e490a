// SPDX-License-Identifier: GPL-3.0-or-later
// Hair over a viewport, after the view transform: light through the scene's colour management.

#include "include/display_place.glsl"

void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy - origin);
  vec4 light = texelFetch(passes, pixel, 0);
  if (light.a == 0.0) {
    discard;
  }
  float side = float(textureSize(display_table, 0).x);
  vec3 at = display_place(exposure * light.rgb / light.a);
  vec3 display = textureLod(display_table, (at * (side - 1.0) + 0.5) / side, 0.0).rgb;
  // Blender interprets colours drawn over a viewport as display colours to the power of 2.2, for any display encoding.
  color = vec4(pow(display, vec3(2.2)), 1.0) * (opacity * light.a / float(pass_count));
  gl_FragDepth = texelFetch(depths, pixel, 0).r;
}
