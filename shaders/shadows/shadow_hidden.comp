// SPDX-License-Identifier: GPL-3.0-or-later
// Depth behind which surfaces occlude strands: the greatest around a texel, as surfaces may be inclined.

#include "shadows/opacity.glsl"

void main()
{
  ivec2 here = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(here, textureSize(surface_depth, 0).xy))) {
    return;
  }
  ivec2 last = textureSize(surface_depth, 0).xy - 1;
  float hidden = -1.0;
  for (int y = -1; y <= 1; y++) {
    for (int x = -1; x <= 1; x++) {
      hidden = max(hidden, texelFetch(surface_depth, ivec3(clamp(here + ivec2(x, y), ivec2(0), last), 0), 0).r);
    }
  }
  imageStore(filtered, ivec3(here, layer), vec4(hidden + SURFACE_BIAS));
}
