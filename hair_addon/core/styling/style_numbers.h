// SPDX-License-Identifier: GPL-3.0-or-later
//
// Directions, angles and random numbers of the styles. Stands after vectors.h in a function's body.

const auto smoothstep = [&](lanes value) {
  const lanes x = clamped(value, lanes(0.0f), lanes(1.0f));
  return x * x * (3.0f - 2.0f * x);
};
// A direction as a unit vector; another one where it is shorter than `least`.
const auto unit_or = [&](const vector& direction, lanes least, const vector& other) {
  const lanes square = dot(direction, direction);
  const auto is_long = square > least * least;
  return chosen(is_long, direction * inverse_root_of(is_long ? square : lanes(1.0f)), other);
};

// u, perpendicular to the unit vector a, by the least rotation from a to the unit vector b [Bishop75]. Opposite
// directions have none: u stays.
const auto turned = [&](const vector& u, const vector& a, const vector& b) {
  const lanes facing = 1.0f + dot(a, b);
  const auto is_facing = facing > 1.0e-6f;
  const lanes lean = is_facing ? dot(u, b) / (is_facing ? facing : lanes(1.0f)) : lanes(0.0f);
  return plus(u, a + b, -lean);
};

// c0 x^n + c1 x^(n-1) + … of the coefficients c0, c1 ….
const auto polynomial = [&](lanes x, float first, auto... others) {
  lanes sum = first;
  ((sum = fused(sum, x, lanes(others))), ...);
  return sum;
};

// Sine and cosine of whole turns: by a GPU's own instructions, 4e-7, or polynomials of least error over a turn, 1e-7,
// that vanish where these do.
const auto sine_and_cosine = [&](lanes turns, lanes& sine, lanes& cosine) {
  const lanes x = turns - floor_of(turns + 0.5f);
#if defined(__CUDA_ARCH__)
  sine = __sinf(6.28318530718f * x);
  cosine = __cosf(6.28318530718f * x);
#else
  const lanes z = x * x;
  sine = x * (0.25f - z) * polynomial(z, 12.23330116f, -38.12319565f, 67.04389954f, -64.83467865f, 25.13273048f);
  cosine = (0.0625f - z)
      * polynomial(z, -6.54000998f, 25.56709099f, -58.57185364f, 81.78964233f, -59.82727432f, 16.0f);
#endif
};

// x to the power e, for x and e from 0 to 1; 0 for x = 0.
const auto power = [&](lanes x, lanes e) {
  const auto is_positive = x > 1.0e-30f;
  const ints bits = bits_of_lanes(is_positive ? x : lanes(1.0f));
  // x = m 2ⁿ, m from √½ to √2; log2(m) by the series of the inverse hyperbolic tangent.
  const ints shifted = bits - 0x3f3504f3;
  const ints n = shifted >> 23;
  const lanes m = lanes_of_bits((shifted & 0x007fffff) + 0x3f3504f3);
  const lanes z = (m - 1.0f) / (m + 1.0f);
  const lanes z2 = z * z;
  const lanes series = z * polynomial(z2, 0.4121985831f, 0.5770780164f, 0.9617966939f, 2.8853900818f);
  const lanes y = higher_of(e * (to_lanes(n) + series), lanes(-126.0f));
  const lanes nearest = floor_of(y + 0.5f);
  const lanes f = y - nearest;
  lanes result = polynomial(
      f, 1.5403530e-4f, 1.3333558e-3f, 9.6181291e-3f, 5.5504109e-2f, 2.4022651e-1f, 6.9314718e-1f, 1.0f
  );
  result *= lanes_of_bits((to_ints(nearest) + 127) << 23);
  return is_positive ? result : lanes(0.0f);
};

// Random numbers in [0, 1) that follow from an identity, a seed and a purpose (random_numbers.py is its twin).
const auto random_number = [&](ints identity, int seed, auto purpose) {
  uints x;
  for (int lane = 0; lane < LANES; ++lane) set_lane(x, lane, static_cast<unsigned>(get_lane(identity, lane)));
  uints which;
  for (int lane = 0; lane < LANES; ++lane) set_lane(which, lane, static_cast<unsigned>(get_lane(purpose, lane)));
  x = (x ^ (static_cast<unsigned>(seed) * 0x9e3779b9u)) + which * 0x85ebca6bu;
  x ^= x >> 16u;
  x *= 0x7feb352du;
  x ^= x >> 15u;
  x *= 0x846ca68bu;
  x ^= x >> 16u;
  return to_lanes(x >> 8u) * 5.9604644775390625e-8f;
};
