// SPDX-License-Identifier: GPL-3.0-or-later
//
// Vector types for code that is compiled for CPU and GPU: WIDTH numbers in Clang's vectors on the CPU; one number on a
// GPU, whose threads are lanes of a vector already.
//
// Included at the top of a function's body, so that everything is local to the function. Operators and `?:` act on
// each lane. WIDTH must be defined before.
//
// A lane's result is bit-identical for any contents of other lanes and on any processor. Compilers may therefore not
// fuse multiplications and additions (`fp contract` stays off). Where it saves time, `fused(a, b, c)` is a b + c,
// rounded once: an instruction of GPUs and of CPUs since 2013, ten times slower than two instructions on older ones.

#if defined(__CUDA_ARCH__)
  constexpr int LANES = 1;
  using lanes = float;
  using ints = int;
  using uints = unsigned;
  #define ALWAYS_INLINE
  const auto get_lane = [](auto vector, int) { return vector; };
  const auto set_lane = [](auto& vector, int, auto value) { vector = value; };
  const auto floor_of = [](lanes value) { return floorf(value); };
  const auto sqrt_of = [](lanes value) { return sqrtf(value); };
  const auto inverse_root_of = [](lanes value) { return rsqrtf(value); };
  const auto abs_of = [](lanes value) { return fabsf(value); };
  // Correctly rounded, even if a module's option `fast_math` approximates roots and divisions.
  const auto exact_sqrt_of = [](lanes value) { return __fsqrt_rn(value); };
  const auto exact_quotient_of = [](lanes a, lanes b) { return __fdiv_rn(a, b); };
  const auto fused = [](lanes a, lanes b, lanes c) { return __fmaf_rn(a, b, c); };
  const auto to_ints = [](lanes value) { return static_cast<int>(value); };
  const auto to_uints = [](ints value) { return static_cast<unsigned>(value); };
  const auto to_lanes = [](auto value) { return static_cast<float>(value); };
  const auto lanes_of_bits = [](ints bits) { return __int_as_float(bits); };
  const auto bits_of_lanes = [](lanes value) { return __float_as_int(value); };
  const auto any_of = [](auto condition) { return static_cast<bool>(condition); };
#else
  constexpr int LANES = WIDTH;
  typedef float lanes __attribute__((ext_vector_type(WIDTH)));
  typedef int ints __attribute__((ext_vector_type(WIDTH)));
  typedef unsigned uints __attribute__((ext_vector_type(WIDTH)));
  #define ALWAYS_INLINE __attribute__((always_inline))
  const auto get_lane = [](auto vector, int lane) { return vector[lane]; };
  const auto set_lane = [](auto& vector, int lane, auto value) { vector[lane] = value; };
  const auto floor_of = [](lanes value) { return __builtin_elementwise_floor(value); };
  const auto sqrt_of = [](lanes value) { return __builtin_elementwise_sqrt(value); };
  const auto inverse_root_of = [](lanes value) { return 1.0f / __builtin_elementwise_sqrt(value); };
  const auto abs_of = [](lanes value) { return __builtin_elementwise_abs(value); };
  const auto exact_sqrt_of = [](lanes value) { return __builtin_elementwise_sqrt(value); };
  const auto exact_quotient_of = [](lanes a, lanes b) { return a / b; };
#if defined(__FMA__) || defined(__ARM_FEATURE_FMA)
  const auto fused = [](lanes a, lanes b, lanes c) { return __builtin_elementwise_fma(a, b, c); };
#else
  // In double precision the product is exact and the sum is rounded once. A second rounding, to single precision, can
  // differ only if the sum is halfway between two floats or subnormal: these rare cases use the exact, slow function.
  typedef float four_floats __attribute__((ext_vector_type(4)));
  typedef double four_doubles __attribute__((ext_vector_type(4)));
  typedef long long four_longs __attribute__((ext_vector_type(4)));
  const auto fused = [](lanes a, lanes b, lanes c) {
    const auto fourth = [](const lanes& from, int k) {
      return __builtin_convertvector(reinterpret_cast<const four_floats*>(&from)[k], four_doubles);
    };
    lanes found;
    four_longs is_rare = 0;
#pragma clang loop unroll(full)
    for (int k = 0; k < LANES / 4; ++k) {
      const four_doubles sum = fourth(a, k) * fourth(b, k) + fourth(c, k);
      const four_longs dropped = __builtin_bit_cast(four_longs, sum) & 0x1fffffffLL;
      is_rare |= dropped == 0x10000000LL;
      is_rare |= (__builtin_elementwise_abs(sum) < 0x1p-126) & (sum != 0.0);
      reinterpret_cast<four_floats*>(&found)[k] = __builtin_convertvector(sum, four_floats);
    }
    if (LANES % 4 != 0 || __builtin_reduce_or(is_rare) != 0) {
      for (int lane = 0; lane < LANES; ++lane) found[lane] = __builtin_fmaf(a[lane], b[lane], c[lane]);
    }
    return found;
  };
#endif
  const auto to_ints = [](lanes value) { return __builtin_convertvector(value, ints); };
  const auto to_uints = [](ints value) { return __builtin_convertvector(value, uints); };
  const auto to_lanes = [](auto value) { return __builtin_convertvector(value, lanes); };
  const auto lanes_of_bits = [](ints bits) { return __builtin_bit_cast(lanes, bits); };
  const auto bits_of_lanes = [](lanes value) { return __builtin_bit_cast(ints, value); };
  const auto any_of = [](ints condition) { return __builtin_reduce_or(condition) != 0; };
#endif
using uint = unsigned;
using flags = decltype(lanes() > lanes());  // a condition of each lane
