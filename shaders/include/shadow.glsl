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
  vec2 centre = 0.5 * clip.xy / clip.w + 0.5;
  float depth = light_depth(light.kind, light.position.xyz, light.axis.xyz, position);
  float texel = 1.0 / float(textureSize(hair_front, 0).x);
  float layer = float(light.shadow_layer);
  vec3 total = vec3(0.0);
  for (int y = 0; y < 2; y++) {
    for (int x = 0; x < 2; x++) {
      vec3 at = vec3(centre + (vec2(float(x), float(y)) - 0.5) * texel, layer);
      float lit = step(depth - light.surface_bias, textureLod(surface_front, at, 0.0).r);
      float behind = max(0.0, depth - textureLod(hair_front, at, 0.0).r) / light.extent;
      total += lit * transmitted(strands_in_front(textureLod(hair_layers, at, 0.0), behind), forward);
    }
  }
  return 0.25 * total;
}
