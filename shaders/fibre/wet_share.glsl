// SPDX-License-Identifier: GPL-3.0-or-later
// The share of the wettest look in a strand, the rest being the driest look: `appearance.wet_share`.

const float LEAST_SHARE = 1.0 / 1024.0;

float wet_share(float wetness, float least, float most)
{
  float share = clamp((wetness - least) / (most - least), 0.0, 1.0);
  return (share < LEAST_SHARE) ? 0.0 : ((share > 1.0 - LEAST_SHARE) ? 1.0 : share);
}
