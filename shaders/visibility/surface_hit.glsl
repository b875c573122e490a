// SPDX-License-Identifier: GPL-3.0-or-later
// The point of a surface in a sample, interpolated between the corners of its triangle.

#include "surfaces/surface_corner.glsl"
#include "surfaces/surface_point.glsl"
#include "surfaces/surface_material.glsl"

// Perspective-correct barycentric coordinates at a position in the picture, from -1 to 1, of a triangle in clip space, which
// may extend behind the viewer [Olano97]. facing: its signed area, positive if the front is visible in a view that is not
// mirrored. Corners are relative to the position, so that rounding errors are proportional to the triangle.
vec3 barycentrics_at(vec4 clip[3], vec2 place, out float facing)
{
  vec2 away[3];
  for (int corner = 0; corner < 3; corner++) {
    away[corner] = clip[corner].xy - place * clip[corner].w;
  }
  vec3 barycentrics = vec3(away[1].x * away[2].y - away[1].y * away[2].x,
                     away[2].x * away[0].y - away[2].y * away[0].x,
                     away[0].x * away[1].y - away[0].y * away[1].x);
  facing = barycentrics.x + barycentrics.y + barycentrics.z;
  return barycentrics / ((abs(facing) > 1e-30) ? facing : 1e-30);
}

vec3 unit(vec3 direction)
{
  return direction * inversesqrt(max(dot(direction, direction), 1e-30));
}

float depth_at(vec4 clip[3], vec3 barycentrics)
{
  vec4 there = barycentrics.x * clip[0] + barycentrics.y * clip[1] + barycentrics.z * clip[2];
  return 0.5 * there.z / there.w + 0.5;
}

// triangle: index in the surface; place: position of the sample [samples]; size: of the picture; depth_steps: change of depth
// to the next samples.
SurfacePoint found_point(int triangle, vec2 place, vec2 size, out vec2 depth_steps)
{
  vec4 clip[3];
  mat3 positions;
  mat3 corner_normals;
  mat3x2 uvs;
  mat3x4 seen_x_y;
  mat3x4 seen_z;
  for (int index = 0; index < 3; index++) {
    Corner corner = corner_at(3 * triangle + index);
    positions[index] = corner_position(corner, view.object_to_world);
    clip[index] = view.world_to_clip * vec4(positions[index], 1.0);
    corner_normals[index] = corner_world_normal(corner, view.object_to_world);
    uvs[index] = corner.uv;
    seen_x_y[index] = texelFetch(visibility_x_y, seen_texel_of(corner), 0);
    seen_z[index] = texelFetch(visibility_z, seen_texel_of(corner), 0);
  }
  float facing;
  float beside;
  vec3 barycentrics = barycentrics_at(clip, 2.0 * place / size - 1.0, facing);
  vec3 right = barycentrics_at(clip, 2.0 * (place + vec2(1.0, 0.0)) / size - 1.0, beside);
  vec3 up = barycentrics_at(clip, 2.0 * (place + vec2(0.0, 1.0)) / size - 1.0, beside);
  // A sample on the triangle's edge may be outside by rounding.
  barycentrics = max(barycentrics, vec3(0.0));
  barycentrics /= max(barycentrics.x + barycentrics.y + barycentrics.z, 1e-6);

  SurfacePoint point;
  float depth = depth_at(clip, barycentrics);
  depth_steps = vec2(depth_at(clip, right), depth_at(clip, up)) - depth;
  point.position = positions * barycentrics;
  point.uv = uvs * barycentrics;
  point.uv_right = uvs * right - point.uv;
  point.uv_up = uvs * up - point.uv;
  point.seen_x_y = seen_x_y * barycentrics;
  point.seen_z = seen_z * barycentrics;
  vec3 first = positions[1] - positions[0];
  vec3 second = positions[2] - positions[0];
  float side = ((facing > 0.0) != (view.is_mirrored != 0)) ? 1.0 : -1.0;
  vec2 first_uv = uvs[1] - uvs[0];
  vec2 second_uv = uvs[2] - uvs[0];
  vec3 N = side * unit(corner_normals * barycentrics);
  vec3 map = normal_map(point.uv, point.uv_right, point.uv_up);
  point.N = mapped_normal(N, map, first, second, first_uv, second_uv);
  point.normal_variance =
      normal_variance(side * unit(corner_normals * right) - N, side * unit(corner_normals * up) - N, map);
  return point;
}
