// SPDX-License-Identifier: GPL-3.0-or-later
//
// Nearest points of each query of a cell, for QUERIES_AT_ONCE queries at once in Clang's vectors: the shared candidates
// of the cell are sorted by their distance to each query.
//
// The body of `_rank` in hash_grid.py. Parameters, for Q queries and `limit` slots of neighbors each:
//
//   array_t<vec3> queries                   (Q,) positions [m]
//   array_t<int> order                      (Q,) indices of queries, sorted by cell
//   int first, end                          the cell's range in `order`
//   int candidate_count                     at most CANDIDATE_LIMIT
//   vec_t<CANDIDATE_LIMIT, int> candidates  indices of points, ascending
//   vec_t<CANDIDATE_LIMIT, float> candidates_x, candidates_y, candidates_z
//                                           their coordinates [m]
//   float distance                          search distance [m]
//   float first_radius                      distance within which all points are among the candidates [m]
//   array_t<int> out_indices                (Q, limit) points by ascending distance, -1 in unused slots; SHORT in the
//                                           first slot of a query that needs a wider search
//   array_t<float> out_distances            (Q, limit) [m], infinite in unused slots
//
// Constants:
//
//   QUERIES_AT_ONCE                         queries of a vector
//   CANDIDATE_LIMIT                         a power of two
//   LIMIT                                   most slots of a query
//   SLOTS_AT_ONCE                           slots that are sorted together in registers
//   SHORT                                   see above

#if !defined(__CUDA_ARCH__)
  typedef float floats __attribute__((ext_vector_type(QUERIES_AT_ONCE)));
  typedef double keys __attribute__((ext_vector_type(QUERIES_AT_ONCE)));
  typedef long long bits __attribute__((ext_vector_type(QUERIES_AT_ONCE)));
  const float infinite = __builtin_inff();
  const int limit = out_indices.shape[1];
  const float reach = first_radius * first_radius;
  for (int begin = first; begin < end; begin += QUERIES_AT_ONCE) {
    const int count = end - begin < QUERIES_AT_ONCE ? end - begin : QUERIES_AT_ONCE;
    floats x, y, z;
    for (int lane = 0; lane < QUERIES_AT_ONCE; ++lane) {
      const auto& query = queries.data[order.data[begin + (lane < count ? lane : 0)]];
      x[lane] = query[0];
      y[lane] = query[1];
      z[lane] = query[2];
    }
    keys nearest[LIMIT];
    // Keys sort by squared distance and then by candidate: a float leaves 29 bits of a double free for the candidate.
    keys handed[CANDIDATE_LIMIT];
    for (int candidate = 0; candidate < candidate_count; ++candidate) {
      const floats away_x = candidates_x[candidate] - x;
      const floats away_y = candidates_y[candidate] - y;
      const floats away_z = candidates_z[candidate] - z;
      const floats apart = away_x * away_x + away_y * away_y + away_z * away_z;
      const bits key = __builtin_bit_cast(bits, __builtin_convertvector(apart, keys)) | candidate;
      handed[candidate] = __builtin_bit_cast(keys, key);
    }
    // Insertion sort without branches. Keys beyond the slots in registers are passed on to the next round.
    for (int slot = 0; slot < limit; slot += SLOTS_AT_ONCE) {
      keys kept[SLOTS_AT_ONCE];
      for (int i = 0; i < SLOTS_AT_ONCE; ++i) kept[i] = keys(__builtin_inf());
      for (int candidate = 0; candidate < candidate_count; ++candidate) {
        keys key = handed[candidate];
        #pragma unroll
        for (int i = 0; i < SLOTS_AT_ONCE; ++i) {
          const keys other = kept[i];
          kept[i] = key < other ? key : other;
          key = key < other ? other : key;
        }
        handed[candidate] = key;
      }
      for (int i = 0; i < SLOTS_AT_ONCE && slot + i < limit; ++i) nearest[slot + i] = kept[i];
    }
    for (int lane = 0; lane < count; ++lane) {
      const size_t row = size_t(order.data[begin + lane]) * limit;
      int found_count = 0;
      for (int slot = 0; slot < limit; ++slot) {
        const double key = nearest[slot][lane];
        const float squared = key;
        const float apart = __builtin_sqrtf(squared);
        const bool is_near = squared < reach;
        found_count += is_near;
        // Points out of reach are dropped, except for the nearest.
        const bool is_found = is_near && (slot == 0 || apart < distance);
        const int candidate = __builtin_bit_cast(long long, key) & (CANDIDATE_LIMIT - 1);
        out_indices.data[row + slot] = is_found ? candidates[candidate] : -1;
        out_distances.data[row + slot] = is_found ? apart : infinite;
      }
      if (found_count < limit && (first_radius < distance || found_count == 0)) out_indices.data[row] = SHORT;
    }
  }
#endif
