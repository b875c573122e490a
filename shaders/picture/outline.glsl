// SPDX-License-Identifier: GPL-3.0-or-later

// Far beyond every outline [pixels].
const float NO_HAIR = 1000.0;

// The distance [pixels] from a pixel's center to what covers a part of another pixel, `offset` away: as if its edge had
// moved into that pixel by the part that is covered.
float distance_to_covered(float offset, float coverage)
{
  return coverage > 0.0 ? max(offset + 0.5 - min(coverage, 1.0), 0.0) : NO_HAIR;
}
