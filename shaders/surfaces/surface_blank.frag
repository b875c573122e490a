// SPDX-License-Identifier: GPL-3.0-or-later
// Blanks the samples that show surfaces, before drawing over them.

#include "visibility/sample_values.glsl"

void main()
{
  if (texelFetch(segments, ivec2(gl_FragCoord.xy), 0).r <= NO_SEGMENT) {
    discard;
  }
  color = vec4(0.0);
}
