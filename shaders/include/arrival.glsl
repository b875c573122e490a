// SPDX-License-Identifier: GPL-3.0-or-later
// What lights send to a place, and which part of it arrives: for passes of a render.

#include "include/shadow.glsl"

vec3 irradiance_of(Light light, vec3 position)
{
  return light_irradiance(
      light.kind, light.position.xyz, light.axis.xyz, light.power.rgb, light.cos_cone, light.blend, position);
}

// Nothing of nothing is nothing.
vec3 part_of(vec3 arriving, vec3 sent)
{
  return arriving / max(sent, vec3(1e-12));
}
