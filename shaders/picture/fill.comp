// SPDX-License-Identifier: GPL-3.0-or-later
// Fills a picture with a color, as some graphics drivers take a hundred times as long to clear a texture.

void main()
{
  ivec2 place = ivec2(gl_GlobalInvocationID.xy);
  if (all(lessThan(place, imageSize(picture)))) {
    imageStore(picture, place, fill_color);
  }
}
