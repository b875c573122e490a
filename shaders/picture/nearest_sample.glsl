// SPDX-License-Identifier: GPL-3.0-or-later
// The sample of a pixel, from the texture `places` of picture/history_places.comp: replaces visibility/own_sample.glsl.

ivec2 sample_of(ivec2 texel)
{
  int place = int(texelFetch(places, texel, 0).r);
  int columns = textureSize(segments, 0).x;
  return ivec2(place % columns, place / columns);
}
