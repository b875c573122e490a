// SPDX-License-Identifier: GPL-3.0-or-later
// A film in a viewport: scene-linear light, to which Blender applies the view transform.

void main()
{
  vec2 place = gl_FragCoord.xy - origin;
  if (any(lessThan(place, border.xy)) || any(greaterThan(place, border.zw))) {
    discard;
  }
  color = max(texelFetch(sums, ivec2(place), 0) / weight_sum, vec4(0.0));
}
