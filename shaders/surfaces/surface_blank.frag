// SPDX-License-Identifier: GPL-3.0-or-later
// Empties the samples that show surfaces, so that what is drawn over these is alone there.

#include "visibility/sample_values.glsl"

void main()
{
  if (texelFetch(segments, ivec2(gl_FragCoord.xy), 0).r <= NO_SEGMENT) {
    discard;
  }
  color = vec4(0.0);
}
