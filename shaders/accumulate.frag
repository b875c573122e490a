// SPDX-License-Identifier: GPL-3.0-or-later
// Adds a pass, with several samples per pixel, to the sum of passes: mean light, and the depth of the nearest sample.

void main()
{
  ivec2 corner = ivec2(gl_FragCoord.xy) * samples_per_side;
  vec4 total = vec4(0.0);
  float nearest = 1.0;
  for (int y = 0; y < samples_per_side; y++) {
    for (int x = 0; x < samples_per_side; x++) {
      vec4 hair = texelFetch(picture, corner + ivec2(x, y), 0);
      total += hair;
      if (hair.a > 0.0) {
        nearest = min(nearest, uintBitsToFloat(texelFetch(depths, corner + ivec2(x, y), 0).r));
      }
    }
  }
  if (total.a == 0.0) {
    discard;
  }
  color = total * (weight / float(samples_per_side * samples_per_side));
  gl_FragDepth = nearest;
}
