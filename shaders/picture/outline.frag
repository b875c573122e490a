// SPDX-License-Identifier: GPL-3.0-or-later
// The outline of selected hair over a viewport, after the view transform.

// Opacity of a line at a distance from hair [pixels]: smooth over a pixel on both sides.
vec2 line_opacity(vec2 from_hair)
{
  return clamp(half_width + 0.5 - abs(from_hair - gap - half_width), 0.0, 1.0);
}

void main()
{
  vec4 outlined = texelFetch(distances, ivec2(gl_FragCoord.xy - origin), 0);
  vec2 seen = smoothstep(vec2(0.25), vec2(0.75), outlined.ba);
  vec2 opacity = line_opacity(outlined.rg) * mix(vec2(hidden_opacity), vec2(1.0), seen);
  vec4 active_line = vec4(active_color, 1.0) * opacity.r;
  color = active_line + vec4(selected_color, 1.0) * opacity.g * (1.0 - opacity.r);
  if (color.a == 0.0) {
    discard;
  }
}
