// SPDX-License-Identifier: GPL-3.0-or-later
// Light from Blender's lights, in Blender's units: watts for point, spot and area lights, W/m² for the sun.

#include "include/fibre.glsl"

const int LIGHT_SUN = 0;
const int LIGHT_POINT = 1;
const int LIGHT_SPOT = 2;
const int LIGHT_AREA = 3;

// Unit vector from `position` to the light. axis: the direction in which the light shines.
vec3 to_light(int kind, vec3 light_position, vec3 axis, vec3 position)
{
  return (kind == LIGHT_SUN) ? -axis : normalize(light_position - position);
}

// Variance [rad²] of a light's direction along an axis, as of a disk: a quarter of its angular radius squared. radius: of
// the light, or the tangent of a sun's.
float light_blur(int kind, vec3 light_position, float radius, vec3 position)
{
  vec3 offset = position - light_position;
  float squared = radius * radius / ((kind == LIGHT_SUN) ? 1.0 : max(dot(offset, offset), 1e-8));
  return 0.25 * min(squared, 1.0);
}

// Attenuation of a spot light's beam at an angle: one inside, zero outside the cone, smooth over the part
// `blend` of the way, in cosines, from the cone to the axis.
float spot_falloff(float cos_angle, float cos_cone, float blend)
{
  float inner = mix(cos_cone, 1.0, clamp(blend, 1e-4, 1.0));
  return smoothstep(cos_cone, inner, cos_angle);
}

// Radiance of an area light towards an angle, one without a spread: it is linear in the tangent, zero outside the cone,
// and lets the light keep its power. cos_cone: of half the spread, 0 for the half sphere.
float area_falloff(float cos_angle, float cos_cone)
{
  if (cos_cone < 1e-3) {
    return 1.0;
  }
  float tan_cone = sin_from_cos(cos_cone) / cos_cone;
  float tan_angle = sin_from_cos(cos_angle) / max(cos_angle, 1e-6);
  return max(0.0, tan_cone - tan_angle) / (tan_cone - atan(tan_cone));
}

// Light of a disk of radius r at the distance d, as a part of that of a point of the same power: by their solid angles,
// 2 pi (1 - d / sqrt(d² + r²)) and pi r² / d². ratio: r² / d², of the disk as it is seen.
float disk_part(float ratio)
{
  float root = sqrt(1.0 + ratio);
  return 2.0 / (root * (root + 1.0));
}

// Irradiance [W/m²] of a small ball at `position`, per its cross section. power: RGB watts, or W/m² of a sun; radius: of an
// area light's disk.
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
    // A Lambertian emitter of flux P sends P/pi along its axis.
    float facing = max(cos_angle, 0.0);
    float part = disk_part(radius * radius * facing / distance_squared);
    return power * facing * part * area_falloff(cos_angle, cos_cone) / (PI * distance_squared);
  }
  vec3 irradiance = power / (4.0 * PI * distance_squared);
  return (kind == LIGHT_SPOT) ? irradiance * spot_falloff(cos_angle, cos_cone, blend) : irradiance;
}
