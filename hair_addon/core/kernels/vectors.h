// SPDX-License-Identifier: GPL-3.0-or-later
//
// Vectors of three numbers per lane. To be included after lanes.h in a function's body.

struct vector {
  lanes x, y, z;
  CUDA_CALLABLE vector operator+(const vector& b) const { return {x + b.x, y + b.y, z + b.z}; }
  CUDA_CALLABLE vector operator-(const vector& b) const { return {x - b.x, y - b.y, z - b.z}; }
  CUDA_CALLABLE vector operator*(lanes factor) const { return {x * factor, y * factor, z * factor}; }
};
// a + b factor, rounded once.
const auto plus = [&](const vector& a, const vector& b, lanes factor) {
  return vector{fused(b.x, factor, a.x), fused(b.y, factor, a.y), fused(b.z, factor, a.z)};
};
const auto dot = [&](const vector& a, const vector& b) { return fused(a.x, b.x, fused(a.y, b.y, a.z * b.z)); };
const auto cross = [&](const vector& a, const vector& b) {
  return vector{fused(a.y, b.z, -(a.z * b.y)), fused(a.z, b.x, -(a.x * b.z)), fused(a.x, b.y, -(a.y * b.x))};
};
const auto chosen = [&](auto condition, const vector& a, const vector& b) {
  return vector{condition ? a.x : b.x, condition ? a.y : b.y, condition ? a.z : b.z};
};
const auto lower_of = [&](lanes a, lanes b) { return a < b ? a : b; };
const auto higher_of = [&](lanes a, lanes b) { return a > b ? a : b; };
const auto clamped = [&](lanes value, lanes low, lanes high) { return lower_of(higher_of(value, low), high); };
