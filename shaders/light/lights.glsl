// SPDX-License-Identifier: GPL-3.0-or-later
// Light from Blender's lights, in Blender's units: watts for point, spot and area lights, W/m² for the sun.

#include "fibre/fibre.glsl"
#include "light/lamp_falloff.glsl"

const int LIGHT_SUN = 0;
const int LIGHT_POINT = 1;
const int LIGHT_SPOT = 2;
const int LIGHT_AREA = 3;

// Unit vector from `position` to the light. axis: the direction in which the light shines.
vec3 to_light(int kind, vec3 light_position, vec3 axis, vec3 position)
{
  return (kind == LIGHT_SUN) ? -axis : normalize(light_position - position);
}

// Variance [rad²] of a light's direction along an axis, as for a disk: a quarter of its squared angular radius. radius: of
// the light, or for a sun the tangent of its angular radius.
float light_blur(int kind, vec3 light_position, float radius, vec3 position)
{
  vec3 offset = position - light_position;
  float squared = radius * radius / ((kind == LIGHT_SUN) ? 1.0 : max(dot(offset, offset), 1e-8));
  return 0.25 * min(squared, 1.0);
}

// Irradiance of a small ball by a Lambertian disk that emits 1 W/sr along its axis; height: above the disk's plane, beside:
// distance from its axis. The irradiance of a plane parallel to the disk is exact; a ball receives more at an angle, by the
// mean cosine of the disk's near and far edges.
float disk_irradiance(float height, float beside, float radius)
{
  float squared = radius * radius;
  float outside = height * height + beside * beside - squared;
  float root = sqrt(outside * outside + 4.0 * height * height * squared);
  float flat_part = (outside > 0.0) ? 2.0 * height * height / (root * (root + outside))
                                    : (root - outside) / (2.0 * root * squared);
  vec2 edges = vec2(max(beside - radius, 0.0), beside + radius);
  vec2 cosines = height * inversesqrt(vec2(height * height) + edges * edges);
  return flat_part / (0.5 * (cosines.x + cosines.y));
}

// Irradiance [W/m²] of a small ball at `position`, per its cross section. power: RGB [W], or [W/m²] of a sun; radius: of the
// light's disk, which faces the ball for point and spot lights.
vec3 light_irradiance(int kind,
                      vec3 light_position,
                      vec3 axis,
                      vec3 power,
                      float cos_cone,
                      float blend,
                      float radius,
                      vec3 position)
{
  if (kind == LIGHT_SUN) {
    return power;
  }
  vec3 offset = position - light_position;
  float distance_squared = max(dot(offset, offset), 1e-8);
  float cos_angle = dot(axis, offset) * inversesqrt(distance_squared);
  if (kind == LIGHT_AREA) {
    float height = dot(axis, offset);
    if (height <= 0.0) {
      return vec3(0.0);
    }
    // A Lambertian emitter of flux P sends P/pi along its axis.
    float beside = length(offset - height * axis);
    return power / PI * disk_irradiance(height, beside, radius) * area_falloff(cos_angle, cos_cone);
  }
  // Mean of cos / distance² over the disk.
  float edge = sqrt(distance_squared + radius * radius);
  vec3 irradiance = power / (2.0 * PI * edge * (edge + sqrt(distance_squared)));
  return (kind == LIGHT_SPOT) ? irradiance * spot_falloff(cos_angle, cos_cone, blend) : irradiance;
}
