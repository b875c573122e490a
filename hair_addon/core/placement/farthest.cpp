// SPDX-License-Identifier: GPL-3.0-or-later
//
// Farthest-point sampling [Gonzalez85], LANES points at once in Clang's vectors. Each step updates the gaps that the
// taken point covers and finds the widest remaining gap.
//
// The body of `_take` in farthest.py. Parameters, for Q points (a multiple of LANES):
//
//   array_t<float> known        (8, Q) rows: position [m] x y z, unit normal x y z, density, and the width of the gap
//                               around the point, a squared distance times density; -1 for points not to be taken
//   array_t<int> islands        (Q,) the island of each point, -1 for padding
//   array_t<int> wanted         (islands,) number of points that each island still needs
//   array_t<int> found          (N,) indices of the points taken
//
// Constant:
//
//   LANES                       points of a vector

#if !defined(__CUDA_ARCH__)
  typedef float lanes __attribute__((ext_vector_type(LANES)));
  typedef int ints __attribute__((ext_vector_type(LANES)));
  const int count = islands.shape[0];
  float* row[8];
  for (int i = 0; i < 8; ++i) row[i] = known.data + size_t(i) * count;
  float* width_of = row[7];
  int best = 0;
  for (int point = 1; point < count; ++point) best = width_of[point] > width_of[best] ? point : best;
  for (int rank = 0; rank < found.shape[0] && width_of[best] > 0.0f; ++rank) {
    found.data[rank] = best;
    const int island = islands.data[best];
    const bool is_full = --wanted.data[island] == 0;
    float own[6];
    for (int i = 0; i < 6; ++i) own[i] = row[i][best];
    lanes widest = -1.0f;
    ints where = 0;
    ints index = {0, 1, 2, 3, 4, 5, 6, 7};
    for (int point = 0; point < count; point += LANES, index += LANES) {
      lanes its[8];
      for (int i = 0; i < 8; ++i) __builtin_memcpy(&its[i], row[i] + point, sizeof(lanes));
      ints its_island;
      __builtin_memcpy(&its_island, islands.data + point, sizeof(ints));
      const lanes x = its[0] - own[0], y = its[1] - own[1], z = its[2] - own[2];
      const lanes closer = its[6] * (x * x + y * y + z * z);
      // A point does not cover the other side of a thin part.
      const ints is_facing = its[3] * own[3] + its[4] * own[4] + its[5] * own[5] > 0.0f;
      const lanes left = is_full ? lanes(-1.0f) : (is_facing & (closer < its[7])) ? closer : its[7];
      const lanes width = ((its[7] > 0.0f) & (its_island == island)) ? left : its[7];
      __builtin_memcpy(width_of + point, &width, sizeof(lanes));
      const ints is_wider = width > widest;
      widest = is_wider ? width : widest;
      where = is_wider ? index : where;
    }
    best = where[0];
    float most = widest[0];
    for (int lane = 1; lane < LANES; ++lane) {
      // The first of equally wide gaps.
      const bool is_before = widest[lane] > most || (widest[lane] == most && where[lane] < best);
      most = is_before ? widest[lane] : most;
      best = is_before ? where[lane] : best;
    }
  }
#endif
