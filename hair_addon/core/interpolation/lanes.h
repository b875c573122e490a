// SPDX-License-Identifier: GPL-3.0-or-later
//
// Vectors that one source is compiled with for both kinds of device: eight numbers in Clang's vectors on a processor,
// whose threads are few; one number on a GPU, whose threads are lanes of a vector already.
//
// Included at the head of a function's body, so all of it is local to that function. Operators and `?:` act on each
// lane.

#if defined(__CUDA_ARCH__)
  constexpr int LANES = 1;
  using lanes = float;
  using ints = int;
  const auto get_lane = [](auto vector, int) { return vector; };
  const auto set_lane = [](auto& vector, int, auto value) { vector = value; };
  const auto floor_of = [](lanes value) { return floorf(value); };
  const auto sqrt_of = [](lanes value) { return sqrtf(value); };
  const auto abs_of = [](lanes value) { return fabsf(value); };
  const auto to_ints = [](lanes value) { return static_cast<int>(value); };
  const auto lanes_of_bits = [](ints bits) { return __int_as_float(bits); };
  // Reads the eight numbers of each lane's guide, number i into columns[i]. numbers: (G, 8); guides below zero are
  // none, and read as guide 0.
  const auto read_columns = [](lanes (&columns)[8], ints guides, const float* numbers) {
    for (int i = 0; i < 8; ++i) columns[i] = numbers[size_t(guides < 0 ? 0 : guides) * 8 + i];
  };
#else
  constexpr int LANES = 8;
  typedef float lanes __attribute__((ext_vector_type(8)));
  typedef int ints __attribute__((ext_vector_type(8)));
  const auto get_lane = [](auto vector, int lane) { return vector[lane]; };
  const auto set_lane = [](auto& vector, int lane, auto value) { vector[lane] = value; };
  const auto floor_of = [](lanes value) { return __builtin_elementwise_floor(value); };
  const auto sqrt_of = [](lanes value) { return __builtin_elementwise_sqrt(value); };
  const auto abs_of = [](lanes value) { return __builtin_elementwise_abs(value); };
  const auto to_ints = [](lanes value) { return __builtin_convertvector(value, ints); };
  const auto lanes_of_bits = [](ints bits) { return __builtin_bit_cast(lanes, bits); };
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
