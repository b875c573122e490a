// SPDX-License-Identifier: GPL-3.0-or-later
// The main of programs that fill the samples of a picture in which a strand of this hair is nearest: needs the sampler
// segments and the image picture. They run over a window of it that holds all of this hair, and end by including this.
//
// vec4 sample_value()
//     what a sample is filled with, at the place that `find_place` found

#include "include/this_place.glsl"
#include "include/whole_samples.glsl"

void main()
{
  ivec2 place = ivec2(gl_GlobalInvocationID.xy) + ivec2(window_left, window_bottom);
  ivec2 size = textureSize(segments, 0);
  if (any(greaterThanEqual(place, size))) {
    return;
  }
  // Segments of other hair, and no segment at all, are beyond this hair's count either way.
  uint found = texelFetch(segments, place, 0).r - uint(first_segment);
  if (found < uint(segment_count)) {
    float share = look_share(int(found) / (view.drawn_points - 1));
    if (share > 0.0) {
      find_place(int(found), vec2(place) + 0.5, vec2(size));
      imageStore(picture, place, mixed_light(place, sample_value(), share));
    }
  }
}
