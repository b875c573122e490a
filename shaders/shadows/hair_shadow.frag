// SPDX-License-Identifier: GPL-3.0-or-later
// Part of a surface's light that hair lets through: irradiance past surfaces and hair, relative to that past surfaces.

#include "shadows/hair_shadow.glsl"

void main()
{
  color = vec4(part_past_hair(true), 1.0);
}
