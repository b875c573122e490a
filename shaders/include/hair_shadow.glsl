// SPDX-License-Identifier: GPL-3.0-or-later
// Part of the irradiance of a matt surface that hair lets through.

#include "include/arrival.glsl"
#include "include/world.glsl"

// Visibility of a light from a surface past other surfaces, and past hair too: the mean over texels up to `reach` away.
void visibilities(Light light, vec3 forward, int reach, out float past_surfaces, out vec3 past_hair)
{
  past_surfaces = 1.0;
  past_hair = vec3(1.0);
  vec3 at;
  float depth;
  if (!shadow_place(light, drawn_position, at, depth)) {
    return;
  }
  float texel = 1.0 / float(textureSize(hair_front, 0).x);
  past_surfaces = 0.0;
  past_hair = vec3(0.0);
  for (int y = -reach; y <= reach; y++) {
    for (int x = -reach; x <= reach; x++) {
      vec3 near = at + vec3(float(x), float(y), 0.0) * texel;
      float lit = lit_part(near, depth, SURFACE_BIAS);
      past_surfaces += lit;
      past_hair += lit * transmitted(crossed_before_surface(near, depth), forward);
    }
  }
  float count = float((2 * reach + 1) * (2 * reach + 1));
  past_surfaces /= count;
  past_hair /= count;
}

vec3 part_past_hair(int reach)
{
  vec3 N = normalize(gl_FrontFacing ? surface_normal : -surface_normal);
  mat3 plus;
  mat3 minus;
  world_sides(corner_seen_x_y, corner_seen_z.xy, view.seen_opacity, view.hair_forward.rgb, plus, minus);
  vec3 past_hair = surface_irradiance(plus, minus, N);
  // Of the world's light about as much as of all directions that surfaces leave open.
  float part = corner_seen_z.w / max(corner_seen_z.z, 1e-6);
  vec3 past_surfaces = past_hair / seen_through(part, view.seen_opacity, view.hair_forward.rgb);
  for (int index = 0; index < lights.count; index++) {
    Light light = lights.light[index];
    float cosine = dot(N, to_light(light.kind, light.position.xyz, light.axis.xyz, drawn_position));
    if (cosine > 0.0) {
      vec3 irradiance = cosine * irradiance_of(light, drawn_position);
      float of_surfaces;
      vec3 of_hair;
      visibilities(light, view.hair_forward.rgb, reach, of_surfaces, of_hair);
      past_surfaces += irradiance * of_surfaces;
      past_hair += irradiance * of_hair;
    }
  }
  // Where no light arrives there is none to stop.
  return mix(vec3(1.0), part_of(past_hair, past_surfaces), vec3(greaterThan(past_surfaces, vec3(1e-12))));
}
