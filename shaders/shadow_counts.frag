// SPDX-License-Identifier: GPL-3.0-or-later
// What strand_shadow.comp has counted in each layer, as an opacity map holds it: all up to a layer's far side.

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
