// SPDX-License-Identifier: GPL-3.0-or-later
// Copies a surface's visibility of the world into a layer of array textures, for linked surfaces.

void main()
{
  ivec2 cell = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(cell, textureSize(visibility_x_y, 0)))) {
    return;
  }
  imageStore(joined_x_y, ivec3(cell, layer), texelFetch(visibility_x_y, cell, 0));
  imageStore(joined_z, ivec3(cell, layer), texelFetch(visibility_z, cell, 0));
}
