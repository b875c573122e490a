// SPDX-License-Identifier: GPL-3.0-or-later
// Between the first pass of a shadow map and the second: texels without strands get the nearest front around them, so
// that interpolation of the front is valid.

#include "include/opacity.glsl"

const int REACH = 2;  // texels

float front_at(ivec2 place)
{
  return front_of_bits(texelFetch(fronts, place, 0).r);
}

void main()
{
  ivec2 here = ivec2(gl_FragCoord.xy);
  ivec2 last = textureSize(fronts, 0) - 1;
  float front = front_at(here);
  if (front >= FAR) {
    for (int y = -REACH; y <= REACH; y++) {
      for (int x = -REACH; x <= REACH; x++) {
        front = min(front, front_at(clamp(here + ivec2(x, y), ivec2(0), last)));
      }
    }
  }
  color = vec4(front);
}
