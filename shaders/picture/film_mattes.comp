// SPDX-License-Identifier: GPL-3.0-or-later
// Adds a pass to the coverage of each pixel by labels of objects and their materials: slots of (label, weight), two in a
// texel, of which the picture has several side by side. A pixel with more labels than slots loses those found last.

#include "picture/film_filter.glsl"

const int MOST_SLOTS = 18;

// Ranges of segments begin with a row (start / 65536, start % 65536, label), ascending.
uint range_start(int index)
{
  vec2 parts = texelFetch(matte_ranges, ivec2(index % range_columns, index / range_columns), 0).xy;
  return uint(parts.x) * 65536u + uint(parts.y);
}

int range_of(uint segment)
{
  int low = 0;
  int high = range_count;
  while (high - low > 1) {
    int middle = (low + high) / 2;
    if (range_start(middle) <= segment) {
      low = middle;
    }
    else {
      high = middle;
    }
  }
  return low;
}

void main()
{
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  ivec2 size = ivec2(tile_width, tile_height);
  if (any(greaterThanEqual(pixel, size))) {
    return;
  }
  float labels[MOST_SLOTS];
  float weights[MOST_SLOTS];
  for (int slot = 0; slot < slot_count; slot += 2) {
    int layer = slot / 2;
    vec4 texel = imageLoad(sums, pixel + size * ivec2(layer % layer_columns, layer / layer_columns));
    labels[slot] = texel.x;
    weights[slot] = texel.y;
    labels[slot + 1] = texel.z;
    weights[slot + 1] = texel.w;
  }
  uint start = 1u;  // of the last sample's range, which neighbors often share
  uint end = 0u;
  float label = 0.0;
  for (int y = 0; y < tap_count(); y++) {
    for (int x = 0; x < tap_count(); x++) {
      ivec2 tap = ivec2(x, y);
      uint segment = texelFetch(segments, sample_place(pixel, tap), 0).r;
      if (segment < start || segment >= end) {
        int range = range_of(segment);
        start = range_start(range);
        end = range + 1 < range_count ? range_start(range + 1) : 0xFFFFFFFFu;
        label = texelFetch(matte_ranges, ivec2(range % range_columns, range / range_columns), 0).z;
      }
      if (label == 0.0) {
        continue;
      }
      for (int slot = 0; slot < slot_count; slot++) {
        if (labels[slot] == label || labels[slot] == 0.0) {
          labels[slot] = label;
          weights[slot] += filter_weight(tap);
          break;
        }
      }
    }
  }
  for (int slot = 0; slot < slot_count; slot += 2) {
    int layer = slot / 2;
    vec4 texel = vec4(labels[slot], weights[slot], labels[slot + 1], weights[slot + 1]);
    imageStore(sums, pixel + size * ivec2(layer % layer_columns, layer / layer_columns), texel);
  }
}
