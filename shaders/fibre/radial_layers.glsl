// SPDX-License-Identifier: GPL-3.0-or-later
// Layers of slices at evenly spaced radial roughness, in place of fibre/one_layer.glsl where a map varies it: needs the block
// layers, `radial_tables.Layers`.

#include "fibre/strand_radial.glsl"

const bool HAS_LAYERS = true;

float layer_count()
{
  return layers.count;
}

// (the layer below, the fraction to the next layer)
vec2 this_layer()
{
  float place = (this_radial_roughness() - layers.low) / layers.step;
  float below = clamp(floor(place), 0.0, layers.count - 2.0);
  return vec2(below, clamp(place - below, 0.0, 1.0));
}
