// SPDX-License-Identifier: GPL-3.0-or-later
// The main function of programs that fill the texels of a picture whose sample shows a strand of this hair: needs the sampler
// segments and the image picture. They run over a window that contains all of this hair, include this file last, and
// define
//
// vec4 sample_value()
//     the value of a sample, at the result of `find_place`

#include "strands/placement.glsl"
#include "visibility/strand_hit.glsl"
#include "visibility/own_sample.glsl"
#include "fibre/single_look.glsl"

// Samples of a column per thread. Software drivers execute all branches: with one sample per thread, samples without hair
// would cost as much as others.
const int SAMPLES_OF_THREAD = 8;

// Whether the sample of a texel shows this hair; found: the segment's index in its object.
bool find_hair(ivec2 place, out int found)
{
  return find_segment(texelFetch(segments, sample_of(place), 0).r, found);
}

void main()
{
  ivec2 size = textureSize(segments, 0);
  ivec2 texels = imageSize(picture);
  ivec2 place = ivec2(gl_GlobalInvocationID.xy) * ivec2(1, SAMPLES_OF_THREAD) + ivec2(window_left, window_bottom);
  int end = (place.x < texels.x) ? min(place.y + SAMPLES_OF_THREAD, texels.y) : place.y;
  int found;
  while (true) {
    while (place.y < end && !find_hair(place, found)) {
      place.y++;
    }
    if (place.y >= end) {
      break;
    }
    float share = look_share(found / (view.drawn_points - 1));
    if (share > 0.0) {
      find_place(found, vec2(sample_of(place)) + 0.5, vec2(size));
      imageStore(picture, place, mixed_light(place, sample_value(), share));
    }
    place.y++;
  }
}
