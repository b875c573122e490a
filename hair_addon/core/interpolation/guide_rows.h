// SPDX-License-Identifier: GPL-3.0-or-later
//
// Numbers of guides as vectors of eight lanes, and shares of weights. Stands after lanes.h in a function's body.

#if defined(__CUDA_ARCH__)
  // Reads the eight numbers of each lane's guide, number i into columns[i]. numbers: (G, 8); guides below zero are
  // none, and read as guide 0.
  const auto read_columns = [](lanes (&columns)[8], ints guides, const float* numbers) {
    for (int i = 0; i < 8; ++i) columns[i] = numbers[size_t(guides < 0 ? 0 : guides) * 8 + i];
  };
#else
  // As above: each guide's eight numbers are read as a row, and the rows transposed in three steps of swapped halves.
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
