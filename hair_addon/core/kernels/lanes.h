// SPDX-License-Identifier: GPL-3.0-or-later
//
// Vectors that one source is compiled with for both kinds of device: WIDTH numbers in Clang's vectors on a processor,
// whose threads are few; one number on a GPU, whose threads are lanes of a vector already.
//
// Included at the head of a function's body, so all of it is local to that function. Operators and `?:` act on each
// lane. WIDTH, of numbers in a vector, stands before it.

#if defined(__CUDA_ARCH__)
  constexpr int LANES = 1;
  using lanes = float;
  using ints = int;
  using uints = unsigned;
  const auto get_lane = [](auto vector, int) { return vector; };
  const auto set_lane = [](auto& vector, int, auto value) { vector = value; };
  const auto floor_of = [](lanes value) { return floorf(value); };
  const auto sqrt_of = [](lanes value) { return sqrtf(value); };
  const auto abs_of = [](lanes value) { return fabsf(value); };
  const auto to_ints = [](lanes value) { return static_cast<int>(value); };
  const auto to_lanes = [](auto value) { return static_cast<float>(value); };
  const auto lanes_of_bits = [](ints bits) { return __int_as_float(bits); };
  const auto bits_of_lanes = [](lanes value) { return __float_as_int(value); };
  const auto any_of = [](auto condition) { return static_cast<bool>(condition); };
  const auto put_rows = [](const float* const* rows, int first, lanes* out) {
    for (int k = 0; k < 4; ++k) out[k] = rows[0][first + k];
  };
  const auto least_of = [](ints value) { return value; };
  const auto most_of = [](ints value) { return value; };
#else
  constexpr int LANES = WIDTH;
  typedef float lanes __attribute__((ext_vector_type(WIDTH)));
  typedef int ints __attribute__((ext_vector_type(WIDTH)));
  typedef unsigned uints __attribute__((ext_vector_type(WIDTH)));
  const auto get_lane = [](auto vector, int lane) { return vector[lane]; };
  const auto set_lane = [](auto& vector, int lane, auto value) { vector[lane] = value; };
  const auto floor_of = [](lanes value) { return __builtin_elementwise_floor(value); };
  const auto sqrt_of = [](lanes value) { return __builtin_elementwise_sqrt(value); };
  const auto abs_of = [](lanes value) { return __builtin_elementwise_abs(value); };
  const auto to_ints = [](lanes value) { return __builtin_convertvector(value, ints); };
  const auto to_lanes = [](auto value) { return __builtin_convertvector(value, lanes); };
  const auto lanes_of_bits = [](ints bits) { return __builtin_bit_cast(lanes, bits); };
  const auto bits_of_lanes = [](lanes value) { return __builtin_bit_cast(ints, value); };
  const auto any_of = [](ints condition) { return __builtin_reduce_or(condition) != 0; };
  // Four numbers of each lane, from place `first` of its row on: transposed.
  const auto put_rows = [](const float* const* rows, auto first, lanes* out) {
    typedef float four __attribute__((ext_vector_type(4), aligned(4)));
    typedef float whole_four __attribute__((ext_vector_type(4)));
    // Part j of vector k has the row of lane 4 j + k.
    lanes mixed[4];
    for (int lane = 0; lane < LANES; ++lane) {
      const whole_four row = *reinterpret_cast<const four*>(rows[lane] + first[lane]);
      reinterpret_cast<whole_four*>(&mixed[lane % 4])[lane / 4] = row;
    }
    const auto low = [](auto a, auto b) {
      if constexpr (sizeof(a) == 64) {
        return __builtin_shufflevector(a, b, 0, 16, 1, 17, 4, 20, 5, 21, 8, 24, 9, 25, 12, 28, 13, 29);
      } else {
        return __builtin_shufflevector(a, b, 0, 8, 1, 9, 4, 12, 5, 13);
      }
    };
    const auto high = [](auto a, auto b) {
      if constexpr (sizeof(a) == 64) {
        return __builtin_shufflevector(a, b, 2, 18, 3, 19, 6, 22, 7, 23, 10, 26, 11, 27, 14, 30, 15, 31);
      } else {
        return __builtin_shufflevector(a, b, 2, 10, 3, 11, 6, 14, 7, 15);
      }
    };
    const lanes x_y = low(mixed[0], mixed[2]), more_x_y = low(mixed[1], mixed[3]);
    const lanes z_w = high(mixed[0], mixed[2]), more_z_w = high(mixed[1], mixed[3]);
    out[0] = low(x_y, more_x_y);
    out[1] = high(x_y, more_x_y);
    out[2] = low(z_w, more_z_w);
    out[3] = high(z_w, more_z_w);
  };
  const auto least_of = [](ints value) { return __builtin_reduce_min(value); };
  const auto most_of = [](ints value) { return __builtin_reduce_max(value); };
#endif
