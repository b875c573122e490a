// SPDX-License-Identifier: GPL-3.0-or-later
// A pass of data of a surface.

#include "picture/data_value.glsl"
#include "surfaces/drawn_point.glsl"
#include "surfaces/surface_colors.glsl"

void main()
{
  SurfacePoint point = drawn_point();
  float n_dot_v = max(abs(dot(point.N, to_viewer(point.position))), 1e-4);
  SurfaceColors colors = surface_colors(point, n_dot_v);
  SampleData found;
  found.position = point.position;
  found.N = point.N;
  found.diffuse = colors.diffuse;
  found.albedo = min(colors.diffuse + colors.reflected, vec3(1.0));
  found.uv = point.uv;
  color = data_value(found);
}
