// SPDX-License-Identifier: GPL-3.0-or-later
// The surface under the hair, a Principled BSDF: diffuse below a rough dielectric, or metal. Of a clear one, what it
// reflects, and as alpha the part that it does not let through.

#include "include/surface_visibility.glsl"
#include "include/world.glsl"
#include "include/surface_reflection.glsl"
#include "include/surface_material.glsl"

// Largest light that a picture's half-precision samples hold.
const float BRIGHTEST = 6e4;

// alpha of microfacets and of the normal's change within a sample, which would leave dots of light [Tokuyoshi19].
float filtered_alpha(float roughness, vec3 N)
{
  vec3 x_step = dFdx(N);
  vec3 y_step = dFdy(N);
  float variance = 0.25 * (dot(x_step, x_step) + dot(y_step, y_step));
  float squared = roughness * roughness * roughness * roughness;
  return sqrt(min(squared + min(2.0 * variance, 0.18), 1.0));
}

void main()
{
  vec3 N = normalize(gl_FrontFacing ? surface_normal : -surface_normal);
  N = mapped_normal(N, drawn_position, surface_uv);
  vec3 V = view.is_perspective != 0 ? normalize(view.eye.xyz - drawn_position) : view.eye.xyz;
  float n_dot_v = max(abs(dot(N, V)), 1e-4);
  vec3 albedo = base_color(surface_uv);
  float roughness = base_roughness(surface_uv);
  float alpha = filtered_alpha(roughness, N);
  vec4 share = directional_albedo(surface_albedo, n_dot_v, roughness);
  // A surface that reflects nothing straight on does not at any angle.
  float grazing = share.z * min(50.0 * surface.reflectance, 1.0);
  float coat = surface.reflectance * (share.x - share.z) + grazing;
  vec3 reflectance = mix(vec3(surface.reflectance), albedo, surface.metallic);
  vec3 gain = multiple_reflections(share, reflectance);
  vec3 reflected = gain * mix(vec3(coat), albedo * (share.x - share.y) + share.y, surface.metallic);

  mat3 plus;
  mat3 minus;
  world_sides(corner_seen_x_y, corner_seen_z.xy, view.seen_opacity, view.hair_forward.rgb, plus, minus);
  vec3 irradiance = surface_irradiance(plus, minus, N);
  vec3 highlight = reflected * surface_irradiance(plus, minus, reflect(-V, N)) / PI;
  vec2 turn = sample_turn();
  for (int index = 0; index < lights.count; index++) {
    Light light = lights.light[index];
    vec3 L = to_light(light.kind, light.position.xyz, light.axis.xyz, drawn_position);
    float past_surfaces;
    vec3 past_hair;
    surface_visibility(light, drawn_position, N, view.hair_forward.rgb, turn, past_surfaces, past_hair);
    if (any(greaterThan(past_hair, vec3(0.0)))) {
      vec3 facing = light_irradiance(light.kind,
                                     light.position.xyz,
                                     light.axis.xyz,
                                     light.power.rgb,
                                     light.cos_cone,
                                     light.blend,
                                     light.radius,
                                     drawn_position);
      vec3 arriving = facing * past_hair;
      irradiance += arriving;
      float n_dot_l = max(dot(N, L), 1e-3);
      vec3 H = normalize(L + V);
      float v_dot_h = clamp(dot(V, H), 0.0, 1.0);
      // A light's size widens its highlight: half its angle, seen by the microfacets' normals.
      float blur = light_blur(light.kind, light.position.xyz, light.radius, drawn_position);
      float widened = min(sqrt(alpha * alpha + 0.5 * blur), 1.0);
      vec3 dielectric = vec3(F_dielectric(v_dot_h, surface.reflectance));
      vec3 fresnel = mix(dielectric, F_schlick(v_dot_h, albedo), surface.metallic);
      float n_dot_h = clamp(dot(N, H), 0.0, 1.0);
      float facets = D_ggx(n_dot_h, widened);
      float mirrored = smoothstep(0.25, 1.0, 0.5 * blur / (alpha * alpha));
      if (mirrored > 0.0) {
        facets = mix(facets, D_ggx_of_disk(n_dot_h, sqrt(blur), alpha), mirrored);
      }
      facets *= V_smith(n_dot_l, n_dot_v, alpha);
      highlight += arriving * gain * fresnel * facets;
    }
  }
  if (surface.is_clear != 0) {
    color = vec4(min(highlight, vec3(BRIGHTEST)), coat);
    return;
  }
  vec3 below = (1.0 - surface.metallic) * max(1.0 - coat, 0.0) * albedo;
  color = vec4(min(below * irradiance / PI + highlight, vec3(BRIGHTEST)), 1.0);
}
