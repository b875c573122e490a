// SPDX-License-Identifier: GPL-3.0-or-later
// The depth of surfaces, as the numbers that strands are compared with.

void main()
{
  ivec2 place = ivec2(gl_GlobalInvocationID.xy);
  if (all(lessThan(place, imageSize(depths)))) {
    imageStore(depths, place, uvec4(floatBitsToUint(texelFetch(surface_depth, place, 0).r)));
  }
}
