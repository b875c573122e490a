// SPDX-License-Identifier: GPL-3.0-or-later

// Coordinates of scene-linear light in a display table, from 0 to 1: `display_transform.display_place`.
vec3 display_place(vec3 light)
{
  const float MOST = 512.0;
  const float KNEE = 1.0 / 1024.0;
  return log2(clamp(light, 0.0, MOST) / KNEE + 1.0) / log2(MOST / KNEE + 1.0);
}
