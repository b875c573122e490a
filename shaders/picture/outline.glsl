// SPDX-License-Identifier: GPL-3.0-or-later

// A distance [pixels] beyond every outline.
const float NO_HAIR = 1000.0;

// The distance [pixels] from a pixel's center to hair that covers a fraction of another pixel, `offset` away: the hair's edge
// is moved into that pixel by the covered fraction.
float distance_to_covered(float offset, float coverage)
{
  return coverage > 0.0 ? max(offset + 0.5 - min(coverage, 1.0), 0.0) : NO_HAIR;
}
