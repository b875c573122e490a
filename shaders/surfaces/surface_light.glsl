// SPDX-License-Identifier: GPL-3.0-or-later
// Light from a point of a surface with a Principled BSDF: diffuse below a rough dielectric, or metal.

#include "light/irradiance.glsl"
#include "shadows/surface_visibility.glsl"
#include "light/world.glsl"
#include "surfaces/surface_colors.glsl"

// Maximum light, within the range of a picture's half floats.
const float BRIGHTEST = 6e4;

// alpha of microfacets, widened by the normal's variance within a sample to avoid fireflies [Tokuyoshi19].
float filtered_alpha(float roughness, float variance)
{
  float squared = roughness * roughness * roughness * roughness;
  return sqrt(min(squared + min(2.0 * variance, 0.18), 1.0));
}

struct SurfaceLight {
  vec3 below;  // through the coat
  vec3 highlight;  // reflected by the coat, or by metal
  float coat;  // reflected fraction of uniform light
  float alpha;  // of the microfacets
  float noise;  // variance of the irradiance, relative to its square
};

// turn: from `sample_turn`.
SurfaceLight surface_light(SurfacePoint point, vec2 turn)
{
  vec3 N = point.N;
  vec3 V = to_viewer(point.position);
  float n_dot_v = max(abs(dot(N, V)), 1e-4);
  SurfaceColors colors = surface_colors(point, n_dot_v);
  float alpha = filtered_alpha(colors.roughness, point.normal_variance);

  mat3 plus;
  mat3 minus;
  world_sides(point.seen_x_y, point.seen_z.xy, view.seen_opacity, view.hair_forward.rgb, plus, minus);
  vec3 irradiance = surface_irradiance(plus, minus, N);
  vec3 highlight = colors.reflected * surface_irradiance(plus, minus, reflect(-V, N)) / PI;
  float variance = 0.0;
  for (int index = 0; index < lights.count; index++) {
    Light light = lights.light[index];
    vec3 L = to_light(light.kind, light.position.xyz, light.axis.xyz, point.position);
    SurfaceVisibility seen = surface_visibility(light, point.position, N, view.hair_forward.rgb, turn);
    if (any(greaterThan(seen.past_hair, vec3(0.0)))) {
      vec3 facing = irradiance_of(light, point.position);
      // A plane receives less light of a wide lobe than a ball, on average by the lobe's variance.
      float blur = light_blur(light.kind, light.position.xyz, light.radius, point.position);
      variance += seen.variance * squared_mean(facing);
      vec3 arriving = facing * seen.past_hair * ((light.kind == LIGHT_SUN) ? 1.0 - blur : 1.0);
      irradiance += arriving;
      float n_dot_l = max(dot(N, L), 1e-3);
      vec3 H = normalize(L + V);
      float v_dot_h = clamp(dot(V, H), 0.0, 1.0);
      // A light's size widens its highlight, by half its angle in terms of the microfacets' normals.
      float widened = min(sqrt(alpha * alpha + 0.5 * blur), 1.0);
      vec3 dielectric = vec3(F_dielectric(v_dot_h, surface.reflectance));
      vec3 fresnel = mix(dielectric, F_schlick(v_dot_h, colors.base), surface.metallic);
      float n_dot_h = clamp(dot(N, H), 0.0, 1.0);
      float facets = D_ggx(n_dot_h, widened);
      float mirrored = smoothstep(0.25, 1.0, 0.5 * blur / (alpha * alpha));
      if (mirrored > 0.0) {
        facets = mix(facets, D_ggx_of_disk(n_dot_h, sqrt(blur), alpha), mirrored);
      }
      facets *= V_smith(n_dot_l, n_dot_v, alpha);
      highlight += arriving * colors.gain * fresnel * facets;
    }
  }
  SurfaceLight light_here;
  light_here.below = colors.diffuse * irradiance / PI;
  light_here.highlight = highlight;
  light_here.coat = colors.coat;
  light_here.alpha = alpha;
  light_here.noise = variance / max(squared_mean(irradiance), 1e-20);
  return light_here;
}
