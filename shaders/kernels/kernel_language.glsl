// SPDX-License-Identifier: GPL-3.0-or-later
// What Warp kernels that are translated to GLSL call (core/kernels/glsl_text.py): their threads, arrays, random numbers, and
// functions of Warp that GLSL does not have.

int thread_index()
{
  int group = int(gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x);
  return group * int(gl_WorkGroupSize.x) + int(gl_LocalInvocationID.x);
}

// All arrays of a kernel are in three textures, one for each type of number, one array after another.
ivec2 element_texel(int index)
{
  return ivec2(index & (ROW - 1), index / ROW);
}

float float_at(int index)
{
  return texelFetch(floats, element_texel(index), 0).x;
}

vec2 vec2_at(int index)
{
  return texelFetch(vectors, element_texel(index), 0).xy;
}

vec3 vec3_at(int index)
{
  return texelFetch(vectors, element_texel(index), 0).xyz;
}

vec4 vec4_at(int index)
{
  return texelFetch(vectors, element_texel(index), 0);
}

// Whole numbers as their high and low 16 bits.
uint uint_at(int index)
{
  uvec2 halves = uvec2(texelFetch(words, element_texel(index), 0).xy);
  return (halves.x << 16u) | halves.y;
}

int int_at(int index)
{
  return int(uint_at(index));
}

vec4 texel_of_float(float value)
{
  return vec4(value, 0.0, 0.0, 0.0);
}

vec4 texel_of_vec3(vec3 value)
{
  return vec4(value, 0.0);
}

vec4 texel_of_vec4(vec4 value)
{
  return value;
}

vec4 texel_of_uint(uint value)
{
  return vec4(float(value >> 16u), float(value & 65535u), 0.0, 0.0);
}

vec4 texel_of_int(int value)
{
  return texel_of_uint(uint(value));
}

// [Jarzynski20], as warp/native/rand.h has it: the same numbers on all devices.
uint rand_pcg(uint state)
{
  uint b = state * 747796405u + 2891336453u;
  uint c = ((b >> ((b >> 28u) + 4u)) ^ b) * 277803737u;
  return (c >> 22u) ^ c;
}

uint rand_init(int seed, int offset)
{
  return rand_pcg(uint(seed) + rand_pcg(uint(offset)));
}

float randf(inout uint state)
{
  state = rand_pcg(state);
  return float(state >> 8u) * (1.0 / 16777216.0);
}

vec3 unit_of(vec3 v)
{
  float size = length(v);
  return (size > 0.0) ? v / size : vec3(0.0);
}

float greatest(vec3 v)
{
  return max(v.x, max(v.y, v.z));
}

float sign_of(float x)
{
  return (x < 0.0) ? -1.0 : 1.0;
}

// The arc sine of some drivers has only three correct digits.
float arc_sine(float x)
{
  return atan(x, sqrt(max(0.0, (1.0 - x) * (1.0 + x))));
}
