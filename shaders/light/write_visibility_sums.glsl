// SPDX-License-Identifier: GPL-3.0-or-later
// Adds visibility to the sums over earlier directions; needs the images seen_*.

void put_seen(ivec2 cell, Seen sums)
{
  if (is_first == 0) {
    sums.x_y += imageLoad(seen_x_y, cell);
    sums.z += imageLoad(seen_z, cell);
    sums.surface += imageLoad(seen_surface, cell);
    sums.channels += imageLoad(seen_channels, cell);
    sums.color += imageLoad(seen_color, cell);
  }
  imageStore(seen_x_y, cell, sums.x_y);
  imageStore(seen_z, cell, sums.z);
  imageStore(seen_surface, cell, sums.surface);
  imageStore(seen_channels, cell, sums.channels);
  imageStore(seen_color, cell, sums.color);
}
