// SPDX-License-Identifier: GPL-3.0-or-later
// Reads the shadow maps of a light: needs the samplers hair_front, hair_layers, surface_front.

#include "include/opacity.glsl"

// What arrives at a depth, read at one place of a light's maps.
vec3 visibility_at(vec3 at, float depth, Light light, vec3 forward)
{
  // Half a bias either side: a soft step that neither stripes a surface nor lets it shine through itself.
  float behind_surface = depth - light.surface_bias - textureLod(surface_front, at, 0.0).r;
  float lit = 1.0 - smoothstep(-0.5, 0.5, behind_surface / light.surface_bias);
  float behind_hair = max(0.0, depth - textureLod(hair_front, at, 0.0).r) / light.extent;
  return lit * transmitted(strands_in_front(textureLod(hair_layers, at, 0.0), behind_hair), forward);
}

// Part of a light that arrives at a point, through strands and past surfaces: the mean over (2 reach + 1)² texels.
// forward: what one strand passes on.
vec3 visibility(Light light, vec3 position, vec3 forward, int reach)
{
  if (light.shadow_layer < 0) {
    return vec3(1.0);
  }
  vec4 clip = light.world_to_shadow * vec4(position, 1.0);
  vec2 centre = 0.5 * clip.xy / clip.w + 0.5;
  // The maps hold the hair and what is near it; nothing is known of a surface further off.
  if (clip.w <= 0.0 || centre != clamp(centre, vec2(0.0), vec2(1.0))) {
    return vec3(1.0);
  }
  float depth = light_depth(light.kind, light.position.xyz, light.axis.xyz, position);
  float texel = 1.0 / float(textureSize(hair_front, 0).x);
  vec3 total = vec3(0.0);
  for (int y = -reach; y <= reach; y++) {
    for (int x = -reach; x <= reach; x++) {
      vec3 at = vec3(centre + vec2(float(x), float(y)) * texel, float(light.shadow_layer));
      total += visibility_at(at, depth, light, forward);
    }
  }
  return total / float((2 * reach + 1) * (2 * reach + 1));
}
