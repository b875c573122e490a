// SPDX-License-Identifier: GPL-3.0-or-later
// Cumulative opacity per layer from the counts of strand_shadow.comp.

#include "include/opacity.glsl"

void main()
{
  ivec2 here = ivec2(gl_FragCoord.xy);
  float sum = 0.0;
  vec4 found;
  for (int layer = 0; layer < 4; layer++) {
    sum += float(texelFetch(counts, ivec2(here.x * 4 + layer, here.y), 0).r) / COUNT_UNIT;
    found[layer] = sum;
  }
  color = found;
}
