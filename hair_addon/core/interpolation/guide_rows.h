// SPDX-License-Identifier: GPL-3.0-or-later
//
// Numbers of guides as vectors of eight lanes, and normalization of weights. Include after lanes.h in a function.

// Reads `count` numbers into the first lanes, and writes them; likewise pairs, in one vector for each of both numbers.

#if defined(__CUDA_ARCH__)
  const auto read_lanes = [](auto& vector, const auto* from, int) { vector = from[0]; };
  const auto write_lanes = [](auto vector, auto* to, int) { to[0] = vector; };
  const auto read_pairs = [](lanes& first, lanes& second, const float* from, int) {
    first = from[0];
    second = from[1];
  };
  const auto write_pairs = [](lanes first, lanes second, float* to, int) {
    to[0] = first;
    to[1] = second;
  };
  // Reads the eight numbers of each lane's guide, number i into columns[i]. numbers: (G, 8); negative guides are empty
  // slots, and read as guide 0.
  const auto read_columns = [](lanes (&columns)[8], ints guides, const float* numbers) {
    for (int i = 0; i < 8; ++i) columns[i] = numbers[size_t(guides < 0 ? 0 : guides) * 8 + i];
  };
#else
  const auto read_lanes = [](auto& vector, const auto* from, int count) {
    if (count == LANES) {
      __builtin_memcpy(&vector, from, sizeof(vector));
      return;
    }
    for (int lane = 0; lane < count; ++lane) vector[lane] = from[lane];
  };
  const auto write_lanes = [](auto vector, auto* to, int count) {
    if (count == LANES) {
      __builtin_memcpy(to, &vector, sizeof(vector));
      return;
    }
    for (int lane = 0; lane < count; ++lane) to[lane] = vector[lane];
  };
  const auto read_pairs = [](lanes& first, lanes& second, const float* from, int count) {
    if (count < LANES) {
      for (int lane = 0; lane < count; ++lane) first[lane] = from[2 * lane], second[lane] = from[2 * lane + 1];
      return;
    }
    lanes low, high;
    __builtin_memcpy(&low, from, sizeof(lanes));
    __builtin_memcpy(&high, from + LANES, sizeof(lanes));
    first = __builtin_shufflevector(low, high, 0, 2, 4, 6, 8, 10, 12, 14);
    second = __builtin_shufflevector(low, high, 1, 3, 5, 7, 9, 11, 13, 15);
  };
  const auto write_pairs = [](lanes first, lanes second, float* to, int count) {
    if (count < LANES) {
      for (int lane = 0; lane < count; ++lane) to[2 * lane] = first[lane], to[2 * lane + 1] = second[lane];
      return;
    }
    const lanes low = __builtin_shufflevector(first, second, 0, 8, 1, 9, 2, 10, 3, 11);
    const lanes high = __builtin_shufflevector(first, second, 4, 12, 5, 13, 6, 14, 7, 15);
    __builtin_memcpy(to, &low, sizeof(lanes));
    __builtin_memcpy(to + LANES, &high, sizeof(lanes));
  };
  // As above: each guide's eight numbers are read as a row, and the rows are transposed in three steps.
  const auto read_columns = [](lanes (&row)[8], ints guides, const float* numbers) {
    for (int lane = 0; lane < 8; ++lane) {
      __builtin_memcpy(&row[lane], numbers + size_t(guides[lane] < 0 ? 0 : guides[lane]) * 8, sizeof(lanes));
    }
    for (int i = 0; i < 8; i += 2) {
      const lanes a = row[i], b = row[i + 1];
      row[i] = __builtin_shufflevector(a, b, 0, 8, 2, 10, 4, 12, 6, 14);
      row[i + 1] = __builtin_shufflevector(a, b, 1, 9, 3, 11, 5, 13, 7, 15);
    }
    for (int i = 0; i < 8; i += i % 4 == 1 ? 3 : 1) {
      const lanes a = row[i], b = row[i + 2];
      row[i] = __builtin_shufflevector(a, b, 0, 1, 8, 9, 4, 5, 12, 13);
      row[i + 2] = __builtin_shufflevector(a, b, 2, 3, 10, 11, 6, 7, 14, 15);
    }
    for (int i = 0; i < 4; ++i) {
      const lanes a = row[i], b = row[i + 4];
      row[i] = __builtin_shufflevector(a, b, 0, 1, 2, 3, 8, 9, 10, 11);
      row[i + 4] = __builtin_shufflevector(a, b, 4, 5, 6, 7, 12, 13, 14, 15);
    }
  };
#endif

// Divides weights by their sum.
const auto normalize = [](float* weight, int count) {
  float total = 0.0f;
  for (int slot = 0; slot < count; ++slot) total += weight[slot];
  for (int slot = 0; slot < count; ++slot) weight[slot] /= total;
};
