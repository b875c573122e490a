// SPDX-License-Identifier: GPL-3.0-or-later
// Sets the depth to zero where hair is nearest, so that no surface behind it is drawn.

#include "visibility/sample_values.glsl"

void main()
{
  if (texelFetch(segments, ivec2(gl_FragCoord.xy), 0).r >= NO_SEGMENT) {
    discard;
  }
  color = vec4(0.0);
  gl_FragDepth = 0.0;
}
