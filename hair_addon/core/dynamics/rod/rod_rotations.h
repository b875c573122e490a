// SPDX-License-Identifier: GPL-3.0-or-later
//
// Rotations as unit quaternions with imaginary part x, y, z. To be included after vectors.h in a function's body.

struct quaternion {
  lanes x, y, z, w;
};
const auto times = [&](const quaternion& a, const quaternion& b) {
  return quaternion{a.w * b.x + b.w * a.x + a.y * b.z - a.z * b.y, a.w * b.y + b.w * a.y + a.z * b.x - a.x * b.z,
                    a.w * b.z + b.w * a.z + a.x * b.y - a.y * b.x, a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z};
};
const auto conjugate = [&](const quaternion& a) { return quaternion{-a.x, -a.y, -a.z, a.w}; };
const auto unit = [&](const quaternion& a) {
  const lanes scale = 1.0f / exact_sqrt_of(a.x * a.x + a.y * a.y + a.z * a.z + a.w * a.w);
  return quaternion{a.x * scale, a.y * scale, a.z * scale, a.w * scale};
};
const auto chosen_rotation = [&](auto condition, const quaternion& a, const quaternion& b) {
  return quaternion{condition ? a.x : b.x, condition ? a.y : b.y, condition ? a.z : b.z, condition ? a.w : b.w};
};
// a rotated by the Cayley map of a rotation vector, by the angle 2 atan(½ |turn|); its inverse is exact on all devices.
const auto turned_by = [&](const vector& turn, const quaternion& a) {
  return unit(times(quaternion{0.5f * turn.x, 0.5f * turn.y, 0.5f * turn.z, lanes(1.0f)}, a));
};
// Image of the z axis under a rotation: the direction of a segment.
const auto direction_of = [&](const quaternion& a) {
  return vector{2.0f * (a.x * a.z + a.w * a.y), 2.0f * (a.y * a.z - a.w * a.x), 1.0f - 2.0f * (a.x * a.x + a.y * a.y)};
};
const auto rotated = [&](const quaternion& a, const vector& v) {
  const vector axis{a.x, a.y, a.z};
  const vector twice = cross(axis, v) * lanes(2.0f);
  return v + twice * a.w + cross(axis, twice);
};
// Interpolates from a (part 0) to b (part 1) along the shorter arc; exact at both ends, and everywhere if a equals b.
const auto between = [&](const quaternion& a, const quaternion& b, float part) {
  if (part == 1.0f) return unit(b);
  const auto is_far = a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w < 0.0f;
  const quaternion c = chosen_rotation(is_far, quaternion{-b.x, -b.y, -b.z, -b.w}, b);
  return unit(quaternion{a.x + part * (c.x - a.x), a.y + part * (c.y - a.y), a.z + part * (c.z - a.z),
                         a.w + part * (c.w - a.w)});
};
// The bend of a joint, e = s⁻¹ (a⁻¹ b) s⁻¹ with positive real part; s is half of the rest rotation from frame a to b.
const auto bend_of = [&](const quaternion& a, const quaternion& b, const quaternion& s) {
  const quaternion back = conjugate(s);
  const quaternion e = times(back, times(times(conjugate(a), b), back));
  return chosen_rotation(e.w < 0.0f, quaternion{-e.x, -e.y, -e.z, -e.w}, e);
};
struct rows {
  vector row[3];
};
// Rows of ∂(2 Im e)/∂θ_b = G = (e_w 1 - [e_v]×) R(a s)ᵀ; ∂(2 Im e)/∂θ_a is -G.
const auto bend_gradient = [&](const quaternion& e, const quaternion& middle) {
  const quaternion& p = middle;
  const lanes xx = p.x * p.x, yy = p.y * p.y, zz = p.z * p.z, xy = p.x * p.y, xz = p.x * p.z, yz = p.y * p.z;
  const lanes wx = p.w * p.x, wy = p.w * p.y, wz = p.w * p.z;
  const vector x_axis{1.0f - 2.0f * (yy + zz), 2.0f * (xy + wz), 2.0f * (xz - wy)};
  const vector y_axis{2.0f * (xy - wz), 1.0f - 2.0f * (xx + zz), 2.0f * (yz + wx)};
  const vector z_axis{2.0f * (xz + wy), 2.0f * (yz - wx), 1.0f - 2.0f * (xx + yy)};
  return rows{{x_axis * e.w + y_axis * e.z - z_axis * e.y, y_axis * e.w - x_axis * e.z + z_axis * e.x,
               x_axis * e.y - y_axis * e.x + z_axis * e.w}};
};
