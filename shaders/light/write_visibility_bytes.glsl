// SPDX-License-Identifier: GPL-3.0-or-later
// Writes the visibility of all directions as bytes, in place of light/write_visibility_sums.glsl. Needs the images seen_*.

void put_seen(ivec2 cell, Seen sums)
{
  Seen bytes = seen_to_bytes(sums);
  imageStore(seen_x_y, cell, bytes.x_y);
  imageStore(seen_z, cell, bytes.z);
  imageStore(seen_surface, cell, bytes.surface);
  imageStore(seen_channels, cell, bytes.channels);
  imageStore(seen_color, cell, bytes.color);
}
