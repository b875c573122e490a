// SPDX-License-Identifier: GPL-3.0-or-later
// In place of light/write_visibility_sums.glsl: what a place sees in all directions, in bytes. Needs the images seen_x_y and the others.

void put_seen(ivec2 cell, Seen sums)
{
  Seen bytes = seen_to_bytes(sums);
  imageStore(seen_x_y, cell, bytes.x_y);
  imageStore(seen_z, cell, bytes.z);
  imageStore(seen_surface, cell, bytes.surface);
  imageStore(seen_channels, cell, bytes.channels);
  imageStore(seen_color, cell, bytes.color);
}
