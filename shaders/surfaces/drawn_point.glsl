// SPDX-License-Identifier: GPL-3.0-or-later
// The point of a surface drawn as triangles.

#include "surfaces/drawn_normal.glsl"
#include "surfaces/surface_point.glsl"
#include "surfaces/surface_material.glsl"

SurfacePoint drawn_point()
{
  SurfacePoint point;
  point.position = drawn_position;
  point.uv = surface_uv;
  point.uv_right = dFdx(surface_uv);
  point.uv_up = dFdy(surface_uv);
  vec3 N = drawn_normal();
  vec3 map = normal_map(point.uv, point.uv_right, point.uv_up);
  point.N = mapped_normal(N, map, dFdx(drawn_position), dFdy(drawn_position), point.uv_right, point.uv_up);
  point.normal_variance = normal_variance(dFdx(N), dFdy(N), map);
  point.seen_x_y = corner_seen_x_y;
  point.seen_z = corner_seen_z;
  return point;
}
