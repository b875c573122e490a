// SPDX-License-Identifier: GPL-3.0-or-later
// Coverage of each pixel by some hair: the fraction of samples in which a segment of that hair is nearest.

void main()
{
  ivec2 corner = ivec2(gl_FragCoord.xy) * samples_per_side - first_place;
  if (any(lessThan(corner, ivec2(0))) || any(greaterThanEqual(corner, textureSize(segments, 0)))) {
    discard;
  }
  int covered = 0;
  for (int y = 0; y < samples_per_side; y++) {
    for (int x = 0; x < samples_per_side; x++) {
      uint found = texelFetch(segments, corner + ivec2(x, y), 0).r - uint(first_segment);
      covered += found < uint(segment_count) ? 1 : 0;
    }
  }
  if (covered == 0) {
    discard;
  }
  color = channel * (float(covered) / float(samples_per_side * samples_per_side));
}
