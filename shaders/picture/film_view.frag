// SPDX-License-Identifier: GPL-3.0-or-later
// A film in a viewport: scene-linear light, to which Blender applies the view transform.

void main()
{
  color = max(texelFetch(sums, ivec2(gl_FragCoord.xy - origin), 0) / weight_sum, vec4(0.0));
}
