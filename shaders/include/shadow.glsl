// SPDX-License-Identifier: GPL-3.0-or-later
// Reads the shadow maps of a light: needs the samplers hair_front, hair_layers, surface_front.

#include "include/opacity.glsl"

// Part of a light that arrives at a point, through strands and past surfaces. forward: what a strand passes on.
vec3 visibility(Light light, vec3 position, vec3 forward)
{
  if (light.shadow_layer < 0) {
    return vec3(1.0);
  }
  vec4 clip = light.world_to_shadow * vec4(position, 1.0);
  vec3 at = vec3(0.5 * clip.xy / clip.w + 0.5, float(light.shadow_layer));
  float depth = light_depth(light.kind, light.position.xyz, light.axis.xyz, position);
  // Half a bias either side: a soft step that neither stripes a surface nor lets it shine through itself.
  float behind_surface = depth - light.surface_bias - textureLod(surface_front, at, 0.0).r;
  float lit = 1.0 - smoothstep(-0.5, 0.5, behind_surface / light.surface_bias);
  float behind = max(0.0, depth - textureLod(hair_front, at, 0.0).r) / light.extent;
  return lit * transmitted(strands_in_front(textureLod(hair_layers, at, 0.0), behind), forward);
}
