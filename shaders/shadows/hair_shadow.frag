// SPDX-License-Identifier: GPL-3.0-or-later
// Fraction of a surface's light that hair lets through: irradiance past surfaces and hair, relative to past surfaces only.

#include "shadows/hair_shadow.glsl"

void main()
{
  color = vec4(part_past_hair(true), 1.0);
}
