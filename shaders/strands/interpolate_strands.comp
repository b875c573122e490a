// SPDX-License-Identifier: GPL-3.0-or-later
// Interpolates strands from their guides into the texture that is drawn, or that styles read:
// core/interpolation/interpolation.py on any GPU.

#include "strands/guide_interpolation.glsl"
#include "strands/write_packed_strand.glsl"
#include "strands/strip.glsl"

// Texels of a strand in `bindings`: root, normal, and guides with their weights, two per texel.
const int BINDING_TEXELS = 2 + (SLOTS + 1) / 2;

void main()
{
  int group = int(gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x);
  int made = group * int(gl_WorkGroupSize.x) + int(gl_LocalInvocationID.x);
  if (made >= some_count) {
    return;
  }
  int strand = first_strand + made;
  ivec2 bound = strand_texel(strand, 0, BINDING_TEXELS, making.row_bindings);
  vec3 root = texelFetch(bindings, bound, 0).xyz;
  vec3 normal = texelFetch(bindings, bound + ivec2(1, 0), 0).xyz;
  vec3 tangent;
  vec3 bitangent;
  root_frame(normal, tangent, bitangent);

  ivec2 guide[SLOTS];
  ivec2 at_normals[SLOTS];
  float share[SLOTS];
  float log_length[SLOTS];
  vec2 turn[SLOTS];
  vec3 first_lower = vec3(0.0);
  vec3 first_tip = vec3(0.0);
  float first_length = 0.0;
  float total = 0.0;
  vec3 mean_normal = vec3(0.0);
  float mean_way = 0.0;
  float tied = 0.0;
  for (int slot = 0; slot < SLOTS; slot++) {
    vec4 pair = texelFetch(bindings, bound + ivec2(2 + slot / 2, 0), 0);
    vec2 weighed = (slot % 2 == 0) ? pair.xy : pair.zw;
    int index = int(weighed.x);
    guide[slot] = strand_texel(index, 0, making.point_count + 2, making.row_segments);
    int row = index / making.row_normals;
    at_normals[slot] = ivec2(index - row * making.row_normals, row);
    vec4 normal_and_tie = texelFetch(guide_normals, at_normals[slot], 0);
    vec3 guide_normal = normal_and_tie.xyz;
    turn[slot] = frame_turn(guide_normal, tangent, bitangent, normal);
    vec4 shape = texelFetch(segments, guide[slot] + ivec2(making.point_count - 1, 0), 0);
    vec3 lower = turned_by(turn[slot], shape.xyz);
    vec3 tip = turned_by(turn[slot], texelFetch(segments, guide[slot] + ivec2(making.point_count, 0), 0).xyz);
    share[slot] = weighed.y;
    log_length[slot] = shape.w;
    if (slot == 0) {
      first_lower = lower;
      first_tip = tip;
      first_length = shape.w;
    }
    else {
      float facing = min(dot(first_lower, lower), dot(first_tip, tip));
      share[slot] *= limited_part(facing, abs(shape.w - first_length), making.limits);
    }
    total += share[slot];
    mean_normal += share[slot] * guide_normal;
    vec3 guide_root = texelFetch(segments, guide[slot] + ivec2(making.point_count + 1, 0), 0).xyz;
    mean_way += share[slot] * length(guide_root - root);
    tied += share[slot] * normal_and_tie.w;
  }
  // No strand is longer than its guides' mean, except by rounding.
  float range = 0.0;
  for (int slot = 0; slot < SLOTS; slot++) {
    share[slot] /= total;
    turn[slot] *= share[slot];
    range += share[slot] * exp(log_length[slot]);
  }
  vec3 limited = limited_normal(normal, mean_normal / total, SPREAD * (mean_way / total) / range);
  if (limited != normal) {
    tangent = carried_along(tangent, normal, limited);
    bitangent = carried_along(bitangent, normal, limited);
    normal = limited;
  }
  range += (tied > 0.0) ? mean_way / total : 0.0;  // means of guides' points begin at the mean of their roots
  range *= 1.001 * making.axes_scale;

  // From the surface's frame to the coordinates of drawn strands.
  tangent = (making.axes * vec4(tangent, 0.0)).xyz;
  bitangent = (making.axes * vec4(bitangent, 0.0)).xyz;
  normal = (making.axes * vec4(normal, 0.0)).xyz;
  vec3 place = (making.axes * vec4(root, 0.0)).xyz;
  begin_strand(made, place, range, making.point_count, making.row_strands);
  vec3 offset = vec3(0.0);
  vec3 middle = -root;  // from the root to the mean of the guides' points
  for (int slot = 0; slot < SLOTS && tied > 0.0; slot++) {
    middle += share[slot] * texelFetch(segments, guide[slot] + ivec2(making.point_count + 1, 0), 0).xyz;
  }
  for (int point = 1; point < making.point_count; point++) {
    float x = 0.0;
    float y = 0.0;
    float z = 0.0;
    float mean_length = 0.0;
    for (int slot = 0; slot < SLOTS; slot++) {
      vec4 its = texelFetch(segments, guide[slot] + ivec2(point - 1, 0), 0);
      add_guide(x, y, z, mean_length, share[slot], turn[slot].x, turn[slot].y, its.x, its.y, its.z, its.w);
    }
    float stretch = stretch_of(x, y, z, mean_length, making.keep_length);
    offset += stretch * (tangent * x + bitangent * y + normal * z);
    float part = 0.0;
    vec3 beside = vec3(0.0);
    if (tied > 0.0) {
      for (int slot = 0; slot < SLOTS; slot++) {
        vec4 its = texelFetch(segments, guide[slot] + ivec2(point - 1, 0), 0);
        vec4 normal_and_tie = texelFetch(guide_normals, at_normals[slot], 0);
        vec3 guide_tangent;
        vec3 guide_bitangent;
        root_frame(normal_and_tie.xyz, guide_tangent, guide_bitangent);
        middle += share[slot] * (guide_tangent * its.x + guide_bitangent * its.y + normal_and_tie.xyz * its.z);
        part += share[slot] * tied_part(float(point), normal_and_tie.w);
      }
      beside = (making.axes * vec4(middle, 0.0)).xyz - offset;
    }
    put_point(point, offset + part * beside);
  }
  end_strand(made);
}
