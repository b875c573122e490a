// SPDX-License-Identifier: GPL-3.0-or-later
// Scattering by the strands around, which look like this strand: neighbors have nearly the same look where maps vary it.
// Needs the sampler dual_table, slices of which run over sqrt(sigma_a) as those of n_slices.

float channel_dual(vec2 at, float sigma_a)
{
  float along = (sqrt(sigma_a) - slices.low) / max(slices.high - slices.low, 1e-6);
  float texel_count = float(textureSize(dual_table, 0).z);
  vec2 layer = this_layer();
  float found = textureLod(dual_table, vec3(at, within_layer(along, texel_count, layer.x)), 0.0).r;
  if (!HAS_LAYERS) {
    return found;
  }
  float next = textureLod(dual_table, vec3(at, within_layer(along, texel_count, layer.x + 1.0)), 0.0).r;
  return mix(found, next, layer.y);
}

vec3 dual(float row, float theta_i)
{
  vec2 at = vec2(theta_i / PI + 0.5, (row + 0.5) / 9.0);
  vec3 sigma_a = this_sigma_a();
  return vec3(channel_dual(at, sigma_a.r), channel_dual(at, sigma_a.g), channel_dual(at, sigma_a.b));
}
