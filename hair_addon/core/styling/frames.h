// SPDX-License-Identifier: GPL-3.0-or-later
//
// Frames of a strand's segments, by least rotations [Bishop75]: from the centre's reference to the strand's normal, to
// its first segment, and from each segment to the next. u and t × u are across segment i, with t × u the other way
// where the surface's own axes are mirrored: all styles are mirrored with them.

const auto upward_of = [&](const vector& along, const vector& sideways) { return cross(along, sideways) * hand; };
// The reference across the normal of the clump's centre.
const auto reference = [&]() {
  // r(n), in the surface's own axes, is continuous everywhere but straight below.
  const auto to_axes = [&](const vector& v) {
    return vector{
        axes.data[0][0] * v.x + axes.data[0][1] * v.y + axes.data[0][2] * v.z,
        axes.data[1][0] * v.x + axes.data[1][1] * v.y + axes.data[1][2] * v.z,
        axes.data[2][0] * v.x + axes.data[2][1] * v.y + axes.data[2][2] * v.z,
    };
  };
  const auto from_axes = [&](const vector& v) {
    return vector{
        axes.data[0][0] * v.x + axes.data[1][0] * v.y + axes.data[2][0] * v.z,
        axes.data[0][1] * v.x + axes.data[1][1] * v.y + axes.data[2][1] * v.z,
        axes.data[0][2] * v.x + axes.data[1][2] * v.y + axes.data[2][2] * v.z,
    };
  };
  const vector n = to_axes(centre_normal);
  const lanes above = higher_of(1.0f + n.z, lanes(1.0e-6f));
  return from_axes({1.0f - n.x * n.x / above, -n.x * n.y / above, -n.x});
};
// The first segment's frame, of that reference.
const auto first_frame = [&](const vector& at_centre) {
  return turned(turned(at_centre, centre_normal, normal), normal, t[1]);
};
const auto put_frames = [&](vector* u) {
  vector across = first_frame(reference());
  u[1] = across;
  for (int i = 2; i < point_count; ++i) {
    across = turned(across, t[i - 1], t[i]);
    u[i] = across;
  }
};
