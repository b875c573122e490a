// SPDX-License-Identifier: GPL-3.0-or-later
// Irradiance of lights at a point, and its visible fraction: for render passes.

#include "shadows/shadow.glsl"

vec3 irradiance_of(Light light, vec3 position)
{
  return light_irradiance(
      light.kind, light.position.xyz, light.axis.xyz, light.power.rgb, light.cos_cone, light.blend, light.radius, position);
}

// Avoids 0 / 0.
vec3 part_of(vec3 arriving, vec3 sent)
{
  return arriving / max(sent, vec3(1e-12));
}
