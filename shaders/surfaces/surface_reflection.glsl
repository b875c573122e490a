// SPDX-License-Identifier: GPL-3.0-or-later
// Reflection of light by a rough surface with GGX microfacets [Walter07]. Cosines are positive.

#include "fibre/constants.glsl"

// Density of microfacets' normals at an angle to the surface's normal. alpha: the square of the roughness.
float D_ggx(float n_dot_h, float alpha)
{
  float squared = alpha * alpha;
  float spread = (n_dot_h * squared - n_dot_h) * n_dot_h + 1.0;
  return squared / (PI * spread * spread);
}

// The same for light from a disk, whose border a smooth surface mirrors: all half vectors within half of its angular radius
// are treated alike. n_dot_h: for the disk's center; half_radius: half of the angular radius. The factor preserves the
// integral for small angles.
float D_ggx_of_disk(float n_dot_h, float half_radius, float alpha)
{
  float outside = max(acos(clamp(n_dot_h, 0.0, 1.0)) - half_radius, 0.0);
  float ratio = half_radius / alpha;
  return D_ggx(cos(outside), alpha) / (1.0 + ratio * (0.5 * PI + ratio));
}

// Fraction of the microfacets visible from both light and eye, divided by 4 (N·L) (N·V) [Heitz14, Eq. 99].
float V_smith(float n_dot_l, float n_dot_v, float alpha)
{
  float squared = alpha * alpha;
  float to_eye = n_dot_l * sqrt((n_dot_v - n_dot_v * squared) * n_dot_v + squared);
  float to_light = n_dot_v * sqrt((n_dot_l - n_dot_l * squared) * n_dot_l + squared);
  return 0.5 / max(to_eye + to_light, 1e-7);
}

// Fresnel reflectance of a dielectric; reflectance: at normal incidence.
float F_dielectric(float cosine, float reflectance)
{
  float root = sqrt(min(reflectance, 0.99));
  float refractive_index = (1.0 + root) / (1.0 - root);
  float g = sqrt(max(refractive_index * refractive_index - 1.0 + cosine * cosine, 0.0));
  float across = (g - cosine) / max(g + cosine, 1e-7);
  float along = (cosine * (g + cosine) - 1.0) / (cosine * (g - cosine) + 1.0);
  return 0.5 * across * across * (1.0 + along * along);
}

// Fresnel reflectance of a metal, approximately.
vec3 F_schlick(float cosine, vec3 reflectance)
{
  float rest = 1.0 - cosine;
  return reflectance + (vec3(1.0) - reflectance) * rest * rest * rest * rest * rest;
}

// Uniform light that microfacets reflect towards the eye: a lookup in the table of core/shading/tables/surface_albedo.py,
// whose first and last texel centers are at 0 and 1.
vec4 directional_albedo(sampler2D albedo_table, float n_dot_v, float roughness)
{
  float size = float(textureSize(albedo_table, 0).x);
  return textureLod(albedo_table, (vec2(n_dot_v, roughness) * (size - 1.0) + 0.5) / size, 0.0);
}

// Factor of light after one reflection by microfacets that includes multiple reflections [Kulla17].
vec3 multiple_reflections(vec4 share, vec3 reflectance)
{
  vec3 mean = (20.0 * reflectance + 1.0) / 21.0;
  vec3 reflected = mean * share.w / (vec3(1.0) - mean * (1.0 - share.w));
  return vec3(1.0) + reflected * (1.0 - share.x) / max(share.x, 0.05);
}
