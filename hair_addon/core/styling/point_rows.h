// SPDX-License-Identifier: GPL-3.0-or-later
//
// Points of strands, read and written one after the other, without an array of all. Include after lane_rows.h.
//
// read_points(rows, take) calls take(i, point) for i = 0 … point_count - 1; write_points(rows, is_written, point_at)
// calls point_at(i) in the same order, and writes the rows of lanes for which is_written is true. Between the two,
// spare[k], k below SPARES, stores numbers of each lane without registers.

#if defined(__CUDA_ARCH__)
  // Rows of a warp's threads are adjacent in memory. Its threads copy some points of all rows together through shared
  // memory, so that neighboring threads access neighboring numbers (coalescing).
  constexpr int THREADS = 32, NUMBERS_AT_ONCE = 3 * POINTS_AT_ONCE, STRIDE = NUMBERS_AT_ONCE | 1;  // no bank conflicts
  __shared__ float shared_rows[WP_TILE_BLOCK_DIM / THREADS][THREADS * STRIDE];
  const int thread = threadIdx.x % THREADS;
  float* const staged = shared_rows[threadIdx.x / THREADS];
  const int threads_left = points.shape[0] - (block - thread);
  const int thread_count = threads_left < THREADS ? threads_left : THREADS;
  const unsigned all_threads = 0xffffffffu >> (THREADS - thread_count);
  constexpr int SPARES = NUMBERS_AT_ONCE;
  float* const spare = staged + thread * STRIDE;
  // move(index in memory, relative to the thread's own row; index in `staged`; row), for points from `start` on.
  const auto move_together = [&](int start, auto move) {
    const int count = 3 * (point_count - start);
  #pragma unroll
    for (int k = 0; k < NUMBERS_AT_ONCE; ++k) {
      const int place = k * thread_count + thread, row = place / NUMBERS_AT_ONCE, column = place % NUMBERS_AT_ONCE;
      if (column < count) move((row - thread) * 3 * point_count + 3 * start + column, row * STRIDE + column, row);
    }
  };
  const auto read_points = [&](float* const* rows, auto take) {
    for (int start = 0; start < point_count; start += POINTS_AT_ONCE) {
      move_together(start, [&](int from, int to, int) { staged[to] = rows[0][from]; });
      __syncwarp(all_threads);
      const int end = start + POINTS_AT_ONCE < point_count ? start + POINTS_AT_ONCE : point_count;
      for (int i = start; i < end; ++i) {
        const float* const numbers = staged + thread * STRIDE + 3 * (i - start);
        take(i, vector{numbers[0], numbers[1], numbers[2]});
      }
      __syncwarp(all_threads);
    }
  };
  const auto write_points = [&](float* const* rows, ints is_written, auto point_at) {
    __syncwarp(all_threads);
    const unsigned written = __ballot_sync(all_threads, is_written);
    for (int start = 0; start < point_count; start += POINTS_AT_ONCE) {
      const int end = start + POINTS_AT_ONCE < point_count ? start + POINTS_AT_ONCE : point_count;
      for (int i = start; i < end; ++i) {
        const vector point = point_at(i);
        float* const numbers = staged + thread * STRIDE + 3 * (i - start);
        numbers[0] = point.x;
        numbers[1] = point.y;
        numbers[2] = point.z;
      }
      __syncwarp(all_threads);
      move_together(start, [&](int to, int from, int row) {
        if (written >> row & 1u) rows[0][to] = staged[from];
      });
      __syncwarp(all_threads);
    }
  };
#else
  constexpr int SPARES = 3 * POINTS_AT_ONCE;
  lanes spare[SPARES];
  // Four points, 12 numbers of each lane, at a time; remaining points number by number.
  const auto read_points = [&](float* const* rows, auto take) {
    vector four_points[4];
    lanes* const numbers = reinterpret_cast<lanes*>(four_points);
    int start = 0;
    for (; start + 4 <= point_count; start += 4) {
      for (int k = 0; k < 12; k += 4) read_rows(rows, ints(3 * start + k), numbers + k);
      for (int i = 0; i < 4; ++i) take(start + i, four_points[i]);
    }
    for (int k = 0; k < 3 * (point_count - start); ++k) {
      for (int lane = 0; lane < LANES; ++lane) set_lane(numbers[k], lane, rows[lane][3 * start + k]);
    }
    for (int i = start; i < point_count; ++i) take(i, four_points[i - start]);
  };
  const auto write_points = [&](float* const* rows, ints is_written, auto point_at) {
    vector four_points[4];
    const lanes* const numbers = reinterpret_cast<const lanes*>(four_points);
    const auto write_lanes = [&](int start, int count) {
      for (int lane = 0; lane < lane_count; ++lane) {
        if (!get_lane(is_written, lane)) continue;
        for (int k = 0; k < count; ++k) rows[lane][3 * start + k] = get_lane(numbers[k], lane);
      }
    };
    const bool is_all = lane_count == LANES && !any_of(is_written == 0);
    int start = 0;
    for (; start + 4 <= point_count; start += 4) {
      for (int i = 0; i < 4; ++i) four_points[i] = point_at(start + i);
      if (is_all) {
        for (int k = 0; k < 12; k += 4) write_rows(numbers + k, rows, 3 * start + k);
      } else {
        write_lanes(start, 12);
      }
    }
    for (int i = start; i < point_count; ++i) four_points[i - start] = point_at(i);
    write_lanes(start, 3 * (point_count - start));
  };
#endif
