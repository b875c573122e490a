// SPDX-License-Identifier: GPL-3.0-or-later
// Deep opacity maps [Yuksel08]: how many strands light has crossed, in layers that follow the hair's lit side.

#include "light/lights.glsl"

// Warped depth for filtering the shadows of surfaces: distant occluders get a low weight, which reduces light bleeding
// [Lauritzen08].
const float WARP = 5.0;

float warped_depth(float depth)
{
  return -exp(-WARP * max(depth, -0.25));
}

// Depths of the four layers' far sides behind the first strand, as parts of the hair's extent: thin where light fades.
const vec4 LAYER_ENDS = vec4(0.007, 0.058, 0.205, 0.5);

// Least depth of a layer with strands, for interpolation.
const float LEAST_LAYER = 1e-4;

// Depth of unlit texels, and of the farthest surfaces: they are found behind the hair however far away they are.
const float FAR = 2.0;
const float FAR_SURFACE = 1.4;

// Distance [texels] to which texels without strands take the ends of those around them.
const int FILL_REACH = 2;

// Depth along a light, from the near side of the hair, as a part of the hair's extent. Depths far outside are clamped
// to just outside, as depths are averaged.
float light_depth(int kind, vec3 light_position, vec3 axis, float near, float extent, vec3 position)
{
  float way = (kind == LIGHT_SUN) ? dot(axis, position) : distance(light_position, position);
  return clamp((way - near) / extent, -1.0, FAR);
}

// The layer that a strand at this depth darkens first.
int layer_of(float depth)
{
  vec4 ends = vec4(greaterThan(vec4(depth), LAYER_ENDS));
  return min(int(dot(ends, vec4(1.0))), 3);
}

// Depth bias of surfaces, as a part of the hair's extent.
const float SURFACE_BIAS = 0.002;

// The layer that a strand at this depth is counted in, 4 for none. ends: front and back depth of the strands that no surface
// hides; hidden: depth behind which one does. Hidden strands are counted behind all others: where shadows of surfaces leak,
// theirs remain.
int layer_among(float depth, vec2 ends, float hidden)
{
  int layer = layer_of(depth - ends.x);
  return (depth > hidden) ? max(layer, layer_of(ends.y - ends.x) + 1) : layer;
}

// Strands are counted in integer multiples of this fraction: sums do not depend on the order.
const float COUNT_UNIT = 4096.0;

// A front depth as an integer, and back.
uint front_bits(float depth)
{
  return floatBitsToUint(depth + 1.0);  // not negative: then bits have the order of floats
}

float front_of_bits(uint bits)
{
  return uintBitsToFloat(bits) - 1.0;
}

// Strands in front of a depth: linear between the layers' ends, of which none is behind the last strand. back: depth of
// that; own: what a strand at this depth adds to its layer.
float strands_in_front(vec4 counts, float depth, float back, float own)
{
  vec4 starts = vec4(0.0, LAYER_ENDS.xyz);
  vec4 ends = vec4(LAYER_ENDS.xyz, 2.0 * FAR);
  vec4 part = clamp((vec4(depth) - starts) / max(min(ends, vec4(back)) - starts, vec4(LEAST_LAYER)), 0.0, 1.0);
  vec4 in_layers = counts - vec4(0.0, counts.xyz);
  in_layers[layer_of(depth)] -= min(own, in_layers[layer_of(depth)]);
  return dot(part, in_layers);
}

// Light left after a mean of `count` strands, each of which passes on the part `forward`: the mean of
// forward^k over a Poisson-distributed k.
vec3 transmitted(float count, vec3 forward)
{
  return exp(-count * (vec3(1.0) - forward));
}
