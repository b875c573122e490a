// SPDX-License-Identifier: GPL-3.0-or-later
// Visibility of the world from a strand of linked hair objects: replaces light/strand_visibility.glsl. Each object has a
// layer of the textures.

// Bytes at coordinates [texels] from `seen_texel`.
Seen seen_bytes_at(vec2 texel)
{
  vec3 at = vec3(texel / vec2(textureSize(visibility_x_y, 0).xy), float(object_layer));
  Seen bytes;
  bytes.x_y = textureLod(visibility_x_y, at, 0.0);
  bytes.z = textureLod(visibility_z, at, 0.0);
  bytes.surface = textureLod(visibility_surface, at, 0.0);
  bytes.channels = textureLod(visibility_channels, at, 0.0);
  bytes.color = textureLod(visibility_color, at, 0.0);
  return bytes;
}
