// SPDX-License-Identifier: GPL-3.0-or-later
// The samples around a pixel and their weights: needs the sampler filter_weights, a row for each axis, and the constants
// samples_per_side, margin, and border, the number of samples around the margins.

ivec2 sample_place(ivec2 pixel, ivec2 tap)
{
  return pixel * samples_per_side + tap + border;
}

float filter_weight(ivec2 tap)
{
  return texelFetch(filter_weights, ivec2(tap.x, 0), 0).r * texelFetch(filter_weights, ivec2(tap.y, 1), 0).r;
}

int tap_count()
{
  return samples_per_side + 2 * margin;
}

bool is_in_pixel(ivec2 tap)
{
  ivec2 place = tap - margin;
  return all(greaterThanEqual(place, ivec2(0))) && all(lessThan(place, ivec2(samples_per_side)));
}
