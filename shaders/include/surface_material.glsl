// SPDX-License-Identifier: GPL-3.0-or-later
// A surface's material at a point: needs the block `surface` and its samplers.

// An image, whose coordinates are given by two rows.
vec4 image_at(sampler2D image, vec2 uv, int first)
{
  vec3 place = vec3(uv, 1.0);
  return texture(image, vec2(dot(surface.image_rows[first].xyz, place), dot(surface.image_rows[first + 1].xyz, place)));
}

vec3 base_color(vec2 uv)
{
  return surface.has_color_image != 0 ? image_at(color_image, uv, 0).rgb : surface.color.rgb;
}

float base_roughness(vec2 uv)
{
  float roughness = surface.roughness;
  if (surface.has_roughness_image != 0) {
    roughness = dot(surface.roughness_channels, image_at(roughness_image, uv, 2));
  }
  // A mirror's highlight of a light without size would be smaller than a sample.
  return clamp(roughness, 0.03, 1.0);
}

// The normal by the normal map, in axes along u and v by what both change from sample to sample.
vec3 mapped_normal(vec3 N, vec3 position, vec2 uv)
{
  if (surface.has_normal_image == 0) {
    return N;
  }
  vec3 x_step = dFdx(position);
  vec3 y_step = dFdy(position);
  vec2 x_uv = dFdx(uv);
  vec2 y_uv = dFdy(uv);
  vec3 x_across = cross(N, x_step);
  vec3 y_across = cross(y_step, N);
  vec3 along_u = x_uv.x * y_across + y_uv.x * x_across;
  vec3 along_v = x_uv.y * y_across + y_uv.y * x_across;
  // Both have the sign of this determinant, which is negative where the picture is mirrored.
  float way = sign(dot(x_step, y_across));
  vec3 T = way * along_u * inversesqrt(max(dot(along_u, along_u), 1e-30));
  vec3 B = way * along_v * inversesqrt(max(dot(along_v, along_v), 1e-30));
  vec3 mapped = 2.0 * image_at(normal_image, uv, 4).xyz - 1.0;
  vec3 bent = normalize(mapped.x * T + mapped.y * B + mapped.z * N);
  return normalize(N + max(surface.normal_strength, 0.0) * (bent - N));
}
