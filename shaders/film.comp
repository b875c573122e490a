// SPDX-License-Identifier: GPL-3.0-or-later
// A pass over a picture, several samples a pixel, joins the sum of all samples.

void main()
{
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, imageSize(sums)))) {
    return;
  }
  vec4 total = imageLoad(sums, pixel);
  for (int y = 0; y < samples_per_side; y++) {
    for (int x = 0; x < samples_per_side; x++) {
      total += texelFetch(picture, pixel * samples_per_side + ivec2(x, y), 0);
    }
  }
  imageStore(sums, pixel, total);
}
