// SPDX-License-Identifier: GPL-3.0-or-later
// Fraction of the irradiance of a matte surface that hair lets through.

#include "light/irradiance.glsl"
#include "shadows/surface_visibility.glsl"
#include "light/world.glsl"

// `surface_visibility` with a single lookup in the maps, which results in hard shadows.
void hard_visibility(Light light, vec3 N, vec3 forward, out float past_surfaces, out vec3 past_hair)
{
  past_surfaces = max(dot(N, to_light(light.kind, light.position.xyz, light.axis.xyz, drawn_position)), 0.0);
  vec3 at;
  float depth;
  bool is_in_map = shadow_place(light, drawn_position, at, depth);
  past_surfaces *= is_in_map ? lit_part(at, depth, SURFACE_BIAS) : 1.0;
  past_hair = past_surfaces * (is_in_map ? transmitted(crossed_before_surface(at, depth), forward) : vec3(1.0));
}

vec3 part_past_hair(bool is_soft)
{
  vec3 N = normalize(gl_FrontFacing ? surface_normal : -surface_normal);
  mat3 plus;
  mat3 minus;
  world_sides(corner_seen_x_y, corner_seen_z.xy, view.seen_opacity, view.hair_forward.rgb, plus, minus);
  vec3 past_hair = surface_irradiance(plus, minus, N);
  // The fraction of the world's light is approximated by that of all directions past surfaces.
  float part = corner_seen_z.w / max(corner_seen_z.z, 1e-6);
  vec3 past_surfaces = past_hair / seen_through(part, view.seen_opacity, view.hair_forward.rgb);
  vec2 turn = sample_turn(picture_place(ivec2(gl_FragCoord.xy)));
  for (int index = 0; index < lights.count; index++) {
    Light light = lights.light[index];
    vec3 irradiance = irradiance_of(light, drawn_position);
    float of_surfaces;
    vec3 of_hair;
    if (is_soft) {
      SurfaceVisibility seen = surface_visibility(light, drawn_position, N, view.hair_forward.rgb, turn);
      of_surfaces = seen.past_surfaces;
      of_hair = seen.past_hair;
    }
    else {
      hard_visibility(light, N, view.hair_forward.rgb, of_surfaces, of_hair);
    }
    past_surfaces += irradiance * of_surfaces;
    past_hair += irradiance * of_hair;
  }
  // Without light there is no shadow.
  return mix(vec3(1.0), min(part_of(past_hair, past_surfaces), vec3(1.0)), vec3(greaterThan(past_surfaces, vec3(1e-12))));
}
