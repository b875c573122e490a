// SPDX-License-Identifier: GPL-3.0-or-later
// Rotation of a surface at a root: core/geometry/surface_deform.py.

vec3 unit_or(vec3 direction, vec3 otherwise)
{
  float size = length(direction);
  return (size > 0.0) ? direction / max(size, 1.0e-37) : otherwise;
}

// The rotation with these first two axes, which are interpolated between vertices and made orthonormal again.
mat3 surface_turn(vec3 x_axis, vec3 y_axis)
{
  vec3 x = unit_or(x_axis, vec3(1.0, 0.0, 0.0));
  vec3 z = unit_or(cross(x, y_axis), vec3(0.0, 0.0, 1.0));
  return mat3(x, cross(z, x), z);
}
