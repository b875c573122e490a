// SPDX-License-Identifier: GPL-3.0-or-later
// A strand between its guides: core/interpolation/guide_weights.py and interpolation.py, [Report12] section 2.4.

#include "strands/lanes.glsl"
#include "guide_sum.strand"

// Tangent and bitangent of a unit normal [Duff17].
void root_frame(vec3 normal, out vec3 tangent, out vec3 bitangent)
{
  float side = (normal.z >= 0.0) ? 1.0 : -1.0;
  float a = -1.0 / (side + normal.z);
  float b = normal.x * normal.y * a;
  tangent = vec3(1.0 + side * normal.x * normal.x * a, side * b, -side * normal.x);
  bitangent = vec3(b, side + normal.y * normal.y * a, -normal.y);
}

// Cosine and sine of the turn from a guide's frame to the strand's, by the least rotation between their normals. For
// opposite normals any rotation is valid.
vec2 frame_turn(vec3 guide_normal, vec3 tangent, vec3 bitangent, vec3 normal)
{
  vec3 guide_tangent;
  vec3 guide_bitangent;
  root_frame(guide_normal, guide_tangent, guide_bitangent);
  float lean = dot(guide_tangent, normal) / max(1.0 + dot(guide_normal, normal), 1e-6);
  vec3 turned = guide_tangent - lean * (guide_normal + normal);
  vec2 turn = vec2(dot(tangent, turned), dot(bitangent, turned));
  float size = length(turn);
  return (size > 0.0) ? turn / size : vec2(0.0);
}

// A vector in a guide's frame → the strand's frame.
vec3 turned_by(vec2 turn, vec3 along)
{
  return vec3(turn.x * along.x - turn.y * along.y, turn.y * along.x + turn.x * along.y, along.z);
}

// Smoothstep from 0 at `first` to 1 after a range; per_range: 1 / the range.
float faded(float first, float per_range, float value)
{
  float x = clamp((value - first) * per_range, 0.0, 1.0);
  return x * x * (3.0 - 2.0 * x);
}

// Factor of a guide's weight, which falls as its directions and its length differ from those of the nearest guide.
// facing: least cosine between their directions; apart: difference of the logarithms of their lengths; limits: the cosine
// at which the factor is zero, 1 / the range of cosines over which it fades, the difference of logarithms at which it is
// zero, and 1 / the range over which it fades, which is the last half of that difference.
float limited_part(float facing, float apart, vec4 limits)
{
  return faded(limits.x, limits.y, facing) * (1.0 - faded(0.5 * limits.z, limits.w, apart));
}
