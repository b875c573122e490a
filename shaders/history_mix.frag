// SPDX-License-Identifier: GPL-3.0-or-later
// What a viewport shows while its picture is refined: the mean of the passes so far, and what is carried from the view
// before, which counts as some passes at first and as none in the end.

void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  float worth = part_left * texelFetch(carried_passes, pixel, 0).r;
  passes = pass_count + worth;
  color = mix(texelFetch(sums, pixel, 0) / weight, texelFetch(carried, pixel, 0), worth / passes);
}
