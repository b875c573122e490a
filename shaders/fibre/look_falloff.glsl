// SPDX-License-Identifier: GPL-3.0-or-later
// `pigment.color_falloff` of strands with the radial roughness of the look.

float this_falloff()
{
  return settings.falloff;
}
