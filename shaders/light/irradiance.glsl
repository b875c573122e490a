// SPDX-License-Identifier: GPL-3.0-or-later
// Irradiance of lights at a point, and its visible fraction. Needs the sampler light_patterns.

#include "shadows/shadow.glsl"

// Light that a lamp's nodes send to a position, relative to the light that its power contains: an equirectangular picture in
// the lamp's axes.
vec3 pattern_at(Light light, vec3 position)
{
  if (light.pattern_layer == 0) {
    return vec3(1.0);
  }
  vec3 along = mat3(light.pattern) * normalize(position - light.position.xyz);
  along /= max(length(along), 1e-12);  // an uneven scale distorts directions
  vec2 place = vec2(0.5 - atan(along.y, along.x) / (2.0 * PI), 0.5 + asin(clamp(along.z, -1.0, 1.0)) / PI);
  return textureLod(light_patterns, vec3(place, float(light.pattern_layer - 1)), 0.0).rgb * light.pattern[3].rgb;
}

vec3 irradiance_of(Light light, vec3 position)
{
  return pattern_at(light, position) * light_irradiance(light.kind,
                                                        light.position.xyz,
                                                        light.axis.xyz,
                                                        light.power.rgb,
                                                        light.cos_cone,
                                                        light.blend,
                                                        light.radius,
                                                        position);
}

// Avoids 0 / 0.
vec3 part_of(vec3 arriving, vec3 sent)
{
  return arriving / max(sent, vec3(1e-12));
}
