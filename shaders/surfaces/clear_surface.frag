// SPDX-License-Identifier: GPL-3.0-or-later
// The reflections of a clear surface; alpha: the fraction of light behind it that it blocks.

#include "surfaces/surface_light.glsl"
#include "surfaces/drawn_point.glsl"

void main()
{
  SurfaceLight light_here = surface_light(drawn_point(), sample_turn(picture_place(ivec2(gl_FragCoord.xy))));
  color = vec4(min(light_here.highlight, vec3(BRIGHTEST)), light_here.coat);
}
