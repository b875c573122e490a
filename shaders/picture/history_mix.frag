// SPDX-License-Identifier: GPL-3.0-or-later
// What a viewport shows while its picture is refined: the mean of the passes so far, and what is carried from the view
// before, which counts as some passes at first and as none in the end.

const float MOST_LIGHT = 6e4;  // of half floats

void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  float worth = part_left * texelFetch(carried_passes, pixel, 0).r;
  passes = pass_count + worth;
  vec4 light = mix(texelFetch(sums, pixel, 0) / weight, texelFetch(carried, pixel, 0), worth / passes);
  // What is not finite would stay, and spread.
  color = clamp(light, -MOST_LIGHT, MOST_LIGHT);
}
