// SPDX-License-Identifier: GPL-3.0-or-later
//
// Adds the mass and momentum of a point to the eight cells around it: integers, whose sums do not depend on the order.
//
// The body of `_add` in hair_volume.py. Parameters:
//
//   int row                       the cell of the point
//   int across, int along         index offset of the next cell along x, along y; 1 along z
//   vec3 part                     position of the point between the cells, 0..1 along each axis
//   float mass                    in 1 / UNIT of the mean
//   vec3 velocity                 [m/s]
//   array_t<int64> sums           (cells, 4), or (cells, 1) for the mass alone
//
// On a CPU no other thread adds to the same array.

{
const int columns = sums.shape[1];
for (int corner = 0; corner < 8; ++corner) {
  const int dx = corner >> 2, dy = (corner >> 1) & 1, dz = corner & 1;
  const float wx = dx ? part[0] : 1.0f - part[0], wy = dy ? part[1] : 1.0f - part[1];
  const float weight = wx * wy * (dz ? part[2] : 1.0f - part[2]) * mass;
  auto* const cell = sums.data + size_t(row + dx * across + dy * along + dz) * columns;
#if defined(__CUDA_ARCH__)
  const auto add = [&](int column, float value) {
    atomicAdd(reinterpret_cast<unsigned long long*>(cell + column), static_cast<unsigned long long>(llrintf(value)));
  };
  add(0, weight);
  for (int axis = 0; axis + 1 < columns; ++axis) add(axis + 1, weight * velocity[axis]);
#else
  if (columns == 1) {
    cell[0] += __builtin_llrintf(weight);
    continue;
  }
  typedef float floats __attribute__((ext_vector_type(4)));
  typedef int integers __attribute__((ext_vector_type(4)));
  typedef long long longs __attribute__((ext_vector_type(4), aligned(8)));
  const floats values = floats{weight, weight * velocity[0], weight * velocity[1], weight * velocity[2]};
  const floats whole = __builtin_elementwise_rint(values);
  const integers is_large = __builtin_elementwise_abs(whole) > 2.0e9f;
  auto* const four = reinterpret_cast<longs*>(cell);
  if (__builtin_reduce_or(is_large)) {
    for (int k = 0; k < 4; ++k) cell[k] += static_cast<long long>(whole[k]);
  } else {
    *four += __builtin_convertvector(__builtin_convertvector(whole, integers), longs);
  }
#endif
}
}
