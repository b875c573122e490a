// SPDX-License-Identifier: GPL-3.0-or-later
// Strands in eight bytes per point: core/geometry/packed_strands.py documents the format.

#include "strands/strip.glsl"

const float PACKED_MOST = 524287.0;  // steps from the root to the end of a strand's range
const int HEAD_TEXELS = 2;  // before the points of a strand: its root and its range

uint normal_bits(uint value)
{
  return (value & 0x1FFFFFFFu) | ((value & 0x20000000u) << 2u) | 0x40000000u;
}

uint packed_bits(float number)
{
  uint bits = floatBitsToUint(number);
  return (bits & 0x1FFFFFFFu) | ((bits >> 31u) << 29u);
}

// Pack an offset from the root whose coordinates are within the range.
vec2 packed_offset(vec3 offset, float range)
{
  vec3 steps = (range > 1e-30) ? offset * (PACKED_MOST / range) : vec3(0.0);
  // Half a step is added, as conversion truncates.
  uvec3 place = uvec3(clamp(steps, -PACKED_MOST, PACKED_MOST) + (PACKED_MOST + 1.5));
  uint low = (place.x << 10u) | (place.z & 1023u);
  uint high = (place.y << 10u) | (place.z >> 10u);
  return vec2(uintBitsToFloat(normal_bits(low)), uintBitsToFloat(normal_bits(high)));
}

vec3 unpacked_offset(vec2 texel, float range)
{
  uint low = packed_bits(texel.x);
  uint high = packed_bits(texel.y);
  uvec3 place = uvec3(low >> 10u, high >> 10u, (low & 1023u) | ((high & 1023u) << 10u));
  return (vec3(place) - (PACKED_MOST + 1.0)) * (range / PACKED_MOST);
}

// First texel of a strand in a texture with `others` extra texels before each strand.
ivec2 packed_first(int strand, int others, int point_count, int row_strands)
{
  return strand_texel(strand, others, others + HEAD_TEXELS + point_count - 1, row_strands);
}

// Root and range of a strand; first: its first texel.
vec4 packed_head(sampler2D texels, ivec2 first)
{
  return vec4(texelFetch(texels, first, 0).xy, texelFetch(texels, first + ivec2(1, 0), 0).xy);
}

// Position of a strand's point; first: the strand's first texel, head: by `packed_head`.
vec3 packed_place(sampler2D texels, ivec2 first, vec4 head, int point)
{
  vec2 texel = texelFetch(texels, first + ivec2(HEAD_TEXELS - 1 + point, 0), 0).xy;
  return head.xyz + ((point > 0) ? unpacked_offset(texel, head.w) : vec3(0.0));
}
