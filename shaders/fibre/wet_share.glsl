// SPDX-License-Identifier: GPL-3.0-or-later
// How far a strand is shaded as the wettest, not as the driest: `appearance.wet_share`.

const float LEAST_SHARE = 1.0 / 1024.0;

float wet_share(float wetness, float least, float most)
{
  float share = clamp((wetness - least) / (most - least), 0.0, 1.0);
  return (share < LEAST_SHARE) ? 0.0 : ((share > 1.0 - LEAST_SHARE) ? 1.0 : share);
}
