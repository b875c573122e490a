// SPDX-License-Identifier: GPL-3.0-or-later
// The shadow of hair over a surface that Blender draws: black, whose alpha is the fraction of light that hair blocks.

#include "shadows/hair_shadow.glsl"

// Only hair has an alpha of 1: picture/accumulate.comp and picture/first_picture.comp tell both apart by it.
const float MOST_ALPHA = 0.999;

void main()
{
  float blocked = 1.0 - dot(part_past_hair(false), vec3(1.0 / 3.0));
  color = vec4(vec3(0.0), min(blocked, MOST_ALPHA));
}
