// SPDX-License-Identifier: GPL-3.0-or-later
// Converts visibility of the world from strands, summed one direction after the other, to bytes.

#include "light/visibility_bytes.glsl"
#include "light/write_visibility_bytes.glsl"

void main()
{
  ivec2 cell = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(cell, imageSize(seen_x_y).xy))) {
    return;
  }
  Seen seen;
  seen.x_y = texelFetch(visibility_x_y, cell, 0);
  seen.z = texelFetch(visibility_z, cell, 0);
  seen.surface = texelFetch(visibility_surface, cell, 0);
  seen.channels = texelFetch(visibility_channels, cell, 0);
  seen.color = texelFetch(visibility_color, cell, 0);
  put_seen(cell, seen);
}
