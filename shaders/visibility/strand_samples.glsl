// SPDX-License-Identifier: GPL-3.0-or-later
// The main of programs that fill the samples of a picture in which a strand of this hair is nearest: needs the sampler
// segments and the image picture. They run over a window of it that holds all of this hair, and end by including this.
//
// vec4 sample_value()
//     what a sample is filled with, at the place that `find_place` found

#include "visibility/strand_hit.glsl"
#include "fibre/single_look.glsl"

// Samples of a column that one thread fills. Software drivers run all of a branch, even if no thread takes it: with one sample
// a thread, those without hair would cost as much as the others.
const int SAMPLES_OF_THREAD = 8;

// Segments of other hair, and no segment at all, are beyond this hair's count either way.
uint segment_at(ivec2 place)
{
  return texelFetch(segments, place, 0).r - uint(view.first_segment);
}

void main()
{
  ivec2 size = textureSize(segments, 0);
  ivec2 place = ivec2(gl_GlobalInvocationID.xy) * ivec2(1, SAMPLES_OF_THREAD) + ivec2(window_left, window_bottom);
  int end = (place.x < size.x) ? min(place.y + SAMPLES_OF_THREAD, size.y) : place.y;
  uint count = uint(view.strand_count * (view.drawn_points - 1));
  while (true) {
    while (place.y < end && segment_at(place) >= count) {
      place.y++;
    }
    if (place.y >= end) {
      break;
    }
    int found = int(segment_at(place));
    float share = look_share(found / (view.drawn_points - 1));
    if (share > 0.0) {
      find_place(found, vec2(place) + 0.5, vec2(size));
      imageStore(picture, place, mixed_light(place, sample_value(), share));
    }
    place.y++;
  }
}
