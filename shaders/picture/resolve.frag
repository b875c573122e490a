// SPDX-License-Identifier: GPL-3.0-or-later
// The mean of a block of samples: downsampling of a supersampled picture.

void main()
{
  ivec2 corner = ivec2(gl_FragCoord.xy) * samples_per_side;
  vec4 total = vec4(0.0);
  for (int y = 0; y < samples_per_side; y++) {
    for (int x = 0; x < samples_per_side; x++) {
      total += texelFetch(picture, corner + ivec2(x, y), 0);
    }
  }
  color = total / float(samples_per_side * samples_per_side);
}
