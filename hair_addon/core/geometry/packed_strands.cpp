// SPDX-License-Identifier: GPL-3.0-or-later
//
// One strand as texels of two floats each: its root and its range, then the offsets of its points from the root.
//
// The body of `_pack_strand` in packed_strands.py. Parameters:
//
//   array_t<vec3> points    (S, P) positions, contiguous
//   int strand              index into the first axis
//   array_t<vec2> texels    (S, P + 1), contiguous
//   array_t<vec3> boxes     (S, 2) lowest and highest coordinates of each strand, contiguous
//
// Constants:
//
//   MOST                    steps on each side of the root

#if !defined(__CUDA_ARCH__)
  const int point_count = points.shape[1];
  const float* place = (const float*)(points.data + (size_t)strand * point_count);
  float* out = (float*)(texels.data + (size_t)strand * (point_count + 1));
  const float x = place[0], y = place[1], z = place[2];
  float low_x = x, low_y = y, low_z = z, high_x = x, high_y = y, high_z = z;
  float not_finite = 0.0f * (x + y + z);  // NaN after the first non-finite coordinate
  for (int i = 1; i < point_count; ++i) {
    const float point_x = place[3 * i], point_y = place[3 * i + 1], point_z = place[3 * i + 2];
    not_finite += 0.0f * (point_x + point_y + point_z);
    low_x = point_x < low_x ? point_x : low_x;
    low_y = point_y < low_y ? point_y : low_y;
    low_z = point_z < low_z ? point_z : low_z;
    high_x = point_x > high_x ? point_x : high_x;
    high_y = point_y > high_y ? point_y : high_y;
    high_z = point_z > high_z ? point_z : high_z;
  }
  const float along[6] = {high_x - x, x - low_x, high_y - y, y - low_y, high_z - z, z - low_z};
  float range = 0.0f;
  for (int i = 0; i < 6; ++i) {
    range = along[i] > range ? along[i] : range;
  }
  float* box = (float*)(boxes.data + (size_t)strand * 2);
  box[0] = low_x;
  box[1] = low_y;
  box[2] = low_z;
  box[3] = high_x;
  box[4] = high_y;
  box[5] = high_z;
  out[0] = x;
  out[1] = y;
  out[2] = z;
  out[3] = range + not_finite;
  const bool is_wide = range > 1e-30f && not_finite == 0.0f;
  const float steps = is_wide ? (float)MOST / range : 0.0f;
  const float middle = (float)MOST + 1.5f;  // includes half a step, because the cast truncates
  unsigned* words = (unsigned*)(out + 2);
  for (int i = 1; i < point_count; ++i) {
    const unsigned column = (unsigned)(int)(is_wide ? (place[3 * i] - x) * steps + middle : middle);
    const unsigned row = (unsigned)(int)(is_wide ? (place[3 * i + 1] - y) * steps + middle : middle);
    const unsigned layer = (unsigned)(int)(is_wide ? (place[3 * i + 2] - z) * steps + middle : middle);
    const unsigned low = (column << 10) | (layer & 1023u);
    const unsigned high = (row << 10) | (layer >> 10);
    // Bit 30 set and bit 29 clear: a normal number for any other bits.
    words[2 * i] = (low & 0x1FFFFFFFu) | ((low & 0x20000000u) << 2) | 0x40000000u;
    words[2 * i + 1] = (high & 0x1FFFFFFFu) | ((high & 0x20000000u) << 2) | 0x40000000u;
  }
#endif
