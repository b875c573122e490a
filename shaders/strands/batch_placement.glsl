// SPDX-License-Identifier: GPL-3.0-or-later
// The linked hair object of a sample: replaces strands/placement.glsl.

#include "strands/batch_object.glsl"

// Whether a segment belongs to any of the objects, which is chosen for the thread; found: its index in the object.
bool find_segment(uint segment, out int found)
{
  found = 0;
  if (segment > uint(last_segment)) {
    return false;
  }
  int low = 0;
  int high = object_count - 1;
  while (low < high) {
    int middle = (low + high + 1) / 2;
    if (whole_number(object_texel(middle, SEGMENT_TEXEL).xy) <= int(segment)) {
      low = middle;
    }
    else {
      high = middle - 1;
    }
  }
  choose_object(low);
  uint index = segment - uint(view.first_segment);
  found = int(index);
  return index < uint(view.strand_count * (view.drawn_points - 1));
}
