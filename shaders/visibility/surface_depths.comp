// SPDX-License-Identifier: GPL-3.0-or-later
// The depth of surfaces, as integers for comparison with strands; also clears segments and picture at the start of a picture.

#include "visibility/sample_values.glsl"

void main()
{
  ivec2 place = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(place, imageSize(depths)))) {
    return;
  }
  imageStore(depths, place, uvec4(floatBitsToUint(texelFetch(surface_depth, place, 0).r)));
  if (is_start != 0) {
    imageStore(segments, place, uvec4(NO_SEGMENT));
  }
  if (is_blank != 0) {
    imageStore(picture, place, vec4(0.0));
  }
}
