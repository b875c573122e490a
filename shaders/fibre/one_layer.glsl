// SPDX-License-Identifier: GPL-3.0-or-later
// Tables of strands with the radial roughness of the look: one layer of slices.

const bool HAS_LAYERS = false;

float layer_count()
{
  return 1.0;
}

vec2 this_layer()
{
  return vec2(0.0);
}
