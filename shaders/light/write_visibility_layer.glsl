// SPDX-License-Identifier: GPL-3.0-or-later
// Writes the visibility of all directions as bytes into a layer of array textures, in place of
// light/write_visibility_bytes.glsl. Needs the images seen_* and the constant `layer`.

void put_seen(ivec2 cell, Seen sums)
{
  Seen bytes = seen_to_bytes(sums);
  ivec3 place = ivec3(cell, layer);
  imageStore(seen_x_y, place, bytes.x_y);
  imageStore(seen_z, place, bytes.z);
  imageStore(seen_surface, place, bytes.surface);
  imageStore(seen_channels, place, bytes.channels);
  imageStore(seen_color, place, bytes.color);
}
