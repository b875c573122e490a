// SPDX-License-Identifier: GPL-3.0-or-later
// Colors of a Principled BSDF under uniform light: diffuse below a rough dielectric, or metal.

#include "surfaces/surface_reflection.glsl"
#include "surfaces/surface_material.glsl"
#include "surfaces/surface_point.glsl"

struct SurfaceColors {
  vec3 base;
  vec3 diffuse;  // reflected below the coat
  vec3 reflected;  // by the coat, or by metal
  vec3 gain;  // factor of light after one reflection that includes multiple reflections
  float coat;  // reflected fraction of uniform light
  float roughness;
};

vec3 to_viewer(vec3 position)
{
  return view.is_perspective != 0 ? normalize(view.eye.xyz - position) : view.eye.xyz;
}

SurfaceColors surface_colors(SurfacePoint point, float n_dot_v)
{
  SurfaceColors colors;
  colors.base = base_color(point.uv, point.uv_right, point.uv_up);
  colors.roughness = base_roughness(point.uv, point.uv_right, point.uv_up);
  vec4 share = directional_albedo(surface_albedo, n_dot_v, colors.roughness);
  // A surface without reflectance at normal incidence reflects nothing at any angle.
  float grazing = share.z * min(50.0 * surface.reflectance, 1.0);
  colors.coat = surface.reflectance * (share.x - share.z) + grazing;
  vec3 metal_reflectance = colors.base * (share.x - share.y) + share.y;
  colors.gain = multiple_reflections(share, mix(vec3(surface.reflectance), colors.base, surface.metallic));
  colors.reflected = colors.gain * mix(vec3(colors.coat), metal_reflectance, surface.metallic);
  colors.diffuse = (1.0 - surface.metallic) * max(1.0 - colors.coat, 0.0) * colors.base;
  return colors;
}
