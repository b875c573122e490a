// SPDX-License-Identifier: GPL-3.0-or-later
//
// Arrays with a row for each lane. Include after lanes.h in a function's body.
//
// read_rows(rows, first, out) reads four numbers of each lane's row, from index `first` of that lane on, into four
// vectors; write_rows(values, rows, first) writes them.

#if defined(__CUDA_ARCH__)
  const auto read_rows = [](const float* const* rows, int first, lanes* out) {
    // Rows of points with their arc lengths are aligned.
    const float4 row = *reinterpret_cast<const float4*>(rows[0] + first);
    out[0] = row.x;
    out[1] = row.y;
    out[2] = row.z;
    out[3] = row.w;
  };
  const auto write_rows = [](const lanes* values, float* const* rows, int first) {
    for (int k = 0; k < 4; ++k) rows[0][first + k] = values[k];
  };
  const auto least_of = [](ints value) { return value; };
  const auto most_of = [](ints value) { return value; };
#else
  // By transposing: part j of vector k is the row of lane 4 j + k.
  typedef float four __attribute__((ext_vector_type(4)));
  typedef float four_anywhere __attribute__((ext_vector_type(4), aligned(4)));
  const auto low_pairs = [](auto a, auto b) {
    if constexpr (sizeof(a) == 64) {
      return __builtin_shufflevector(a, b, 0, 16, 1, 17, 4, 20, 5, 21, 8, 24, 9, 25, 12, 28, 13, 29);
    } else {
      return __builtin_shufflevector(a, b, 0, 8, 1, 9, 4, 12, 5, 13);
    }
  };
  const auto high_pairs = [](auto a, auto b) {
    if constexpr (sizeof(a) == 64) {
      return __builtin_shufflevector(a, b, 2, 18, 3, 19, 6, 22, 7, 23, 10, 26, 11, 27, 14, 30, 15, 31);
    } else {
      return __builtin_shufflevector(a, b, 2, 10, 3, 11, 6, 14, 7, 15);
    }
  };
  const auto transpose = [&](const lanes* from, lanes* to) {
    const lanes first = low_pairs(from[0], from[2]), second = low_pairs(from[1], from[3]);
    const lanes third = high_pairs(from[0], from[2]), fourth = high_pairs(from[1], from[3]);
    to[0] = low_pairs(first, second);
    to[1] = high_pairs(first, second);
    to[2] = low_pairs(third, fourth);
    to[3] = high_pairs(third, fourth);
  };
  const auto read_rows = [&](const float* const* rows, auto first, lanes* out) {
    lanes parts[4];
#pragma clang loop unroll(full)
    for (int lane = 0; lane < LANES; ++lane) {
      const four row = *reinterpret_cast<const four_anywhere*>(rows[lane] + first[lane]);
      reinterpret_cast<four*>(&parts[lane % 4])[lane / 4] = row;
    }
    transpose(parts, out);
  };
  const auto write_rows = [&](const lanes* values, float* const* rows, int first) {
    lanes parts[4];
    transpose(values, parts);
#pragma clang loop unroll(full)
    for (int lane = 0; lane < LANES; ++lane) {
      const four row = reinterpret_cast<const four*>(&parts[lane % 4])[lane / 4];
      *reinterpret_cast<four_anywhere*>(rows[lane] + first) = row;
    }
  };
  const auto least_of = [](ints value) { return __builtin_reduce_min(value); };
  const auto most_of = [](ints value) { return __builtin_reduce_max(value); };
#endif
