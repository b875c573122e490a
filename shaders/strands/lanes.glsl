// SPDX-License-Identifier: GPL-3.0-or-later
// The types and operations of .strand files in GLSL, one strand a thread: core/kernels/lanes.h and vectors.h.

#define lanes float
#define ints int
#define uints uint
#define flags bool
#define vector vec3
#define zero_vector vec3(0.0)
#define vector_of vec3
#define lower_of min
#define higher_of max
#define clamped clamp
#define abs_of abs
#define floor_of floor
#define root_of sqrt
#define sqrt_of sqrt
#define int_of int
#define float_of float
#define to_ints int
#define to_uints uint
#define to_lanes float
#define bits_of_lanes floatBitsToInt
#define lanes_of_bits intBitsToFloat
#define sine_and_cosine sine_and_cosine_of
#define any_of(condition) (condition)
#define chosen(condition, a, b) ((condition) ? (a) : (b))
#define fused(a, b, c) ((a) * (b) + (c))
#define plus(a, b, factor) ((a) + (b) * (factor))
#define exact_quotient_of(a, b) ((a) / (b))
#define inverse_root_of(value) (1.0 / sqrt(value))
#define UNROLL
