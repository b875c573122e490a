// SPDX-License-Identifier: GPL-3.0-or-later
//
// Whether the points of a guide differ from others by more than rounding (guide_layers.py).
//
// The body of `_is_other` in layer_kernels.py. Parameters, for N points:
//
//   int first, int end             the guide's points
//   array_t<vec3> points           (N,)
//   array_t<vec3> others           (N,)
//   float tolerance                as a fraction of the largest coordinate of the others

#if defined(__CUDA_ARCH__)
return false;
#else
typedef float some __attribute__((ext_vector_type(WIDTH), aligned(4)));
typedef int bits __attribute__((ext_vector_type(WIDTH)));
const float* a = reinterpret_cast<const float*>(points.data + first);
const float* b = reinterpret_cast<const float*>(others.data + first);
const int count = 3 * (end - first), whole = count - count % WIDTH;
const auto some_at = [](const float* values) { return *reinterpret_cast<const some*>(values); };
bits differences = 0;
for (int place = 0; place < whole; place += WIDTH) differences |= some_at(a + place) != some_at(b + place);
int is_unequal = __builtin_reduce_or(differences);
for (int place = whole; place < count; ++place) is_unequal |= a[place] != b[place];
if (!is_unequal) return false;
// Bits of absolute values have the order of the values, above which NaN is.
const auto size_of = [](float value) { return __builtin_bit_cast(int, value) & 0x7fffffff; };
int most_apart = 0, extent = 0;
for (int place = 0; place < count; ++place) {
  const int apart = size_of(a[place] - b[place]), size = size_of(b[place]);
  most_apart = apart > most_apart ? apart : most_apart;
  extent = size > extent ? size : extent;
}
return !(__builtin_bit_cast(float, most_apart) <= tolerance * __builtin_bit_cast(float, extent));
#endif
