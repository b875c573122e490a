// SPDX-License-Identifier: GPL-3.0-or-later
// Deep opacity maps [Yuksel08]: how many strands light has crossed, in layers that follow the hair's lit side.

#include "include/lights.glsl"

// Depths of the four layers' far sides behind the first strand, as parts of the hair's extent: thin where light dies.
const vec4 LAYER_ENDS = vec4(0.007, 0.058, 0.205, 0.5);

// Depth along a light: the distance that its light has come, from the origin's plane in the case of a sun.
float light_depth(int kind, vec3 light_position, vec3 axis, vec3 position)
{
  return (kind == LIGHT_SUN) ? dot(axis, position) : distance(light_position, position);
}

// Layers that lie behind a strand at this depth, as parts of the extent: it darkens its own and all deeper ones.
vec4 layers_behind(float depth)
{
  return vec4(lessThanEqual(vec4(depth), LAYER_ENDS)) + vec4(0.0, 0.0, 0.0, float(depth > LAYER_ENDS.w));
}

// Strands in front of a depth: linear between the layers' ends, constant beyond the last.
float strands_in_front(vec4 counts, float depth)
{
  vec4 starts = vec4(0.0, LAYER_ENDS.xyz);
  vec4 part = clamp((vec4(depth) - starts) / (LAYER_ENDS - starts), 0.0, 1.0);
  return dot(part, counts - vec4(0.0, counts.xyz));
}

// Light left after a mean of `count` strands, each of which passes on the part `forward`: the mean of
// forward^k over a Poisson-distributed k.
vec3 transmitted(float count, vec3 forward)
{
  return exp(-count * (vec3(1.0) - forward));
}
