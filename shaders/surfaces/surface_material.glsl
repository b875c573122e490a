// SPDX-License-Identifier: GPL-3.0-or-later
// A surface's material at a point: needs the block `surface` and its samplers.

// A texture lookup; first: the first of two rows that transform uv to coordinates of the image; right, up: change of uv to
// the next samples.
vec4 image_at(sampler2D image, vec2 uv, vec2 right, vec2 up, int first)
{
  mat3x2 rows;
  for (int column = 0; column < 3; column++) {
    rows[column] = vec2(surface.image_rows[first][column], surface.image_rows[first + 1][column]);
  }
  return textureGrad(image, rows * vec3(uv, 1.0), rows * vec3(right, 0.0), rows * vec3(up, 0.0));
}

vec3 base_color(vec2 uv, vec2 right, vec2 up)
{
  if (surface.has_color_image == 0) {
    return surface.color.rgb;
  }
  vec4 color = image_at(color_image, uv, right, up, 0);
  return color.rgb * (surface.is_color_opaque != 0 ? 1.0 : color.a);
}

float base_roughness(vec2 uv, vec2 right, vec2 up)
{
  float roughness = surface.roughness;
  if (surface.has_roughness_image != 0) {
    roughness = dot(surface.roughness_channels, image_at(roughness_image, uv, right, up, 2));
  }
  // The highlight of a light without size on a mirror would be smaller than a sample.
  return clamp(roughness, 0.03, 1.0);
}

// The vector of the normal map, in axes along u, v and the normal.
vec3 normal_map(vec2 uv, vec2 right, vec2 up)
{
  return 2.0 * image_at(normal_image, uv, right, up, 4).xyz - 1.0;
}

// The normal with the normal map applied; the axes along u and v follow from the changes of position and uv in two steps on
// the surface.
vec3 mapped_normal(vec3 N, vec3 map, vec3 x_step, vec3 y_step, vec2 x_uv, vec2 y_uv)
{
  if (surface.has_normal_image == 0) {
    return N;
  }
  vec3 x_across = cross(N, x_step);
  vec3 y_across = cross(y_step, N);
  vec3 along_u = x_uv.x * y_across + y_uv.x * x_across;
  vec3 along_v = x_uv.y * y_across + y_uv.y * x_across;
  // Both have the sign of this determinant, which is negative in a mirrored picture.
  float way = sign(dot(x_step, y_across));
  vec3 T = way * along_u * inversesqrt(max(dot(along_u, along_u), 1e-30));
  vec3 B = way * along_v * inversesqrt(max(dot(along_v, along_v), 1e-30));
  vec3 bent = normalize(map.x * T + map.y * B + map.z * N);
  return normalize(N + max(surface.normal_strength, 0.0) * (bent - N));
}

// Mean squared change of the normal within a sample, along each of two axes: from its steps to the next samples, and from the
// shortening of the normal map's mean [Toksvig05], beyond rounding.
float normal_variance(vec3 x_step, vec3 y_step, vec3 map)
{
  float size = length(map);
  float lost = max(1.0 - size - 0.01, 0.0) / max(size, 0.05);
  float of_map = (surface.has_normal_image != 0) ? lost * surface.normal_strength * surface.normal_strength : 0.0;
  return 0.25 * (dot(x_step, x_step) + dot(y_step, y_step)) + of_map;
}
