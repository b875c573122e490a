// SPDX-License-Identifier: GPL-3.0-or-later
// Lookup of environment images by unit directions: x is at azimuth 0, z at the top.

#include "fibre/constants.glsl"

// Coordinates of a direction in an equirectangular image: longitude from pi to -pi, and latitude.
vec2 equirectangular(vec3 direction)
{
  float longitude = atan(direction.y, direction.x);
  float latitude = atan(direction.z, length(direction.xy));
  return vec2(0.5 - longitude / (2.0 * PI), 0.5 + latitude / PI);
}

vec3 equirectangular_direction(vec2 at)
{
  float longitude = PI * (1.0 - 2.0 * at.x);
  float latitude = PI * (at.y - 0.5);
  return vec3(cos(latitude) * cos(longitude), cos(latitude) * sin(longitude), sin(latitude));
}

// Coordinates of a direction in an image of a mirror ball that is viewed along +y.
vec2 mirror_ball(vec3 direction)
{
  vec3 normal = direction - vec3(0.0, 1.0, 0.0);
  float size = 2.0 * sqrt(max(0.0, -0.5 * normal.y));
  return vec2(0.5) + 0.5 * normal.xz / max(size, 1e-6);
}
