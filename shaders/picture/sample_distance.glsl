// SPDX-License-Identifier: GPL-3.0-or-later

// Distance along the view axis of a depth from 0 to 1. clip: last two rows and columns of the view-to-clip matrix, row by row.
float distance_at(float depth, vec4 clip)
{
  float ndc = 2.0 * depth - 1.0;
  return (clip.w * ndc - clip.y) / (clip.z * ndc - clip.x);
}
