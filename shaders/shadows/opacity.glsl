// SPDX-License-Identifier: GPL-3.0-or-later
// Deep opacity maps [Yuksel08]: the number of strands that light has crossed, in layers that follow the hair's lit side.

#include "light/lights.glsl"

// Warped depth for filtering the shadows of surfaces: distant occluders get a low weight, which reduces light bleeding
// [Lauritzen08].
const float WARP = 5.0;

float warped_depth(float depth)
{
  return -exp(-WARP * max(depth, -0.25));
}

// Depths of the four layers' far sides behind the first strand, as fractions of the hair's extent: thin where light fades.
const vec4 LAYER_ENDS = vec4(0.007, 0.058, 0.205, 0.5);

// Minimum depth of a layer with strands, for interpolation.
const float LEAST_LAYER = 1e-4;

// Depth of empty texels, and maximum depth of surfaces, which are found behind the hair at any distance.
const float FAR = 2.0;
const float FAR_SURFACE = 1.4;

// Distance [texels] up to which texels without strands get the depths of texels around them.
const int FILL_REACH = 2;

// Depth along a light from the near side of the hair, as a fraction of the hair's extent. Depths far outside are clamped, as
// depths are averaged.
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

// Depth bias of surfaces, as a fraction of the hair's extent.
const float SURFACE_BIAS = 0.002;

// The layer in which a strand at this depth is counted, 4 for none. ends: front and back depth of the strands that are not
// occluded by surfaces; hidden: depth behind which strands are. These are counted behind all others, so that their shadows
// remain where shadows of surfaces leak.
int layer_among(float depth, vec2 ends, float hidden)
{
  int layer = layer_of(depth - ends.x);
  return (depth > hidden) ? max(layer, layer_of(ends.y - ends.x) + 1) : layer;
}

// Strands are counted in integer multiples of 1 / COUNT_UNIT, so that sums do not depend on the order.
const float COUNT_UNIT = 4096.0;

// A front depth as an integer, and back.
uint front_bits(float depth)
{
  return floatBitsToUint(depth + 1.0);  // bits of nonnegative floats have the order of the floats
}

float front_of_bits(uint bits)
{
  return uintBitsToFloat(bits) - 1.0;
}

// Number of strands in front of a depth: linear between the layers' ends, which are not behind the last strand. back: depth
// of the last strand; own: count of a strand at this depth in its layer.
float strands_in_front(vec4 counts, float depth, float back, float own)
{
  vec4 starts = vec4(0.0, LAYER_ENDS.xyz);
  vec4 ends = vec4(LAYER_ENDS.xyz, 2.0 * FAR);
  vec4 part = clamp((vec4(depth) - starts) / max(min(ends, vec4(back)) - starts, vec4(LEAST_LAYER)), 0.0, 1.0);
  vec4 in_layers = counts - vec4(0.0, counts.xyz);
  in_layers[layer_of(depth)] -= min(own, in_layers[layer_of(depth)]);
  return dot(part, in_layers);
}

// Fraction of light after a mean of `count` strands, each of which passes on the fraction `forward`: the mean of forward^k
// over a Poisson-distributed k.
vec3 transmitted(float count, vec3 forward)
{
  return exp(-count * (vec3(1.0) - forward));
}
