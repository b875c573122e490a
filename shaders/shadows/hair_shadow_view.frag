// SPDX-License-Identifier: GPL-3.0-or-later
// The shadow of hair over a surface that Blender draws: black, whose alpha is the fraction of light that hair blocks.

#include "shadows/hair_shadow.glsl"

void main()
{
  color = vec4(vec3(0.0), 1.0 - dot(part_past_hair(false), vec3(1.0 / 3.0)));
}
