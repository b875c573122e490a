// SPDX-License-Identifier: GPL-3.0-or-later
// Between the first pass of a shadow map and the second: texels without strands get the nearest front and the last back
// around them, so that interpolation of both is valid.

#include "include/opacity.glsl"

const int REACH = 2;  // texels

vec2 ends_at(ivec2 place)
{
  return vec2(front_of_bits(texelFetch(fronts, place, 0).r), front_of_bits(texelFetch(backs, place, 0).r));
}

void main()
{
  ivec2 here = ivec2(gl_FragCoord.xy);
  ivec2 last = textureSize(fronts, 0) - 1;
  vec2 ends = ends_at(here);
  if (ends.x >= FAR) {
    for (int y = -REACH; y <= REACH; y++) {
      for (int x = -REACH; x <= REACH; x++) {
        vec2 near = ends_at(clamp(here + ivec2(x, y), ivec2(0), last));
        ends = vec2(min(ends.x, near.x), max(ends.y, near.y));
      }
    }
  }
  color = vec4(ends, 0.0, 0.0);
}
