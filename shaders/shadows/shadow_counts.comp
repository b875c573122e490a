// SPDX-License-Identifier: GPL-3.0-or-later
// Cumulative opacity per layer from the counts of shadows/strand_shadow.comp. Also clears the images for the next maps, which
// takes drivers longer.

#include "shadows/opacity.glsl"

void main()
{
  ivec2 here = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(here, imageSize(fronts)))) {
    return;
  }
  int size = imageSize(fronts).x;
  int turn = here.y / size;
  int layer = shadow_views.view[turn].light_index;
  if (layer < 0) {
    return;
  }
  float sum = 0.0;
  vec4 found;
  for (int part = 0; part < 4; part++) {
    ivec2 place = ivec2(here.x * 4 + part, here.y);
    sum += float(imageLoad(counts, place).r) / COUNT_UNIT;
    found[part] = sum;
    imageStore(counts, place, uvec4(0u));
  }
  imageStore(filtered, ivec3(here.x, here.y - turn * size, layer), found);
  imageStore(fronts, here, uvec4(front_bits(FAR)));
  imageStore(backs, here, uvec4(0u));
}
