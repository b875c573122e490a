// SPDX-License-Identifier: GPL-3.0-or-later
// The sample of a texel in a picture of all samples: the same. picture/nearest_sample.glsl replaces this file in programs that
// fill one texel per pixel.

ivec2 sample_of(ivec2 texel)
{
  return texel;
}
