// SPDX-License-Identifier: GPL-3.0-or-later
// Makes strands of their guides in the texture that they are drawn from: core/interpolation/interpolation.py on any GPU.
// Where points were before is left for motion vectors, and the box of each strand for what is around all.

#include "include/guide_sum.glsl"
#include "include/strand.glsl"

// Texels of a strand in `bindings`: root, normal, and guides with their weights, two a texel.
const int BINDING_TEXELS = 2 + (SLOTS + 1) / 2;

void main()
{
  int group = int(gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x);
  int strand = group * int(gl_WorkGroupSize.x) + int(gl_LocalInvocationID.x);
  if (strand >= making.strand_count) {
    return;
  }
  ivec2 bound = strand_texel(strand, 0, BINDING_TEXELS, making.row_bindings);
  vec3 root = texelFetch(bindings, bound, 0).xyz;
  vec3 normal = texelFetch(bindings, bound + ivec2(1, 0), 0).xyz;
  vec3 tangent;
  vec3 bitangent;
  root_frame(normal, tangent, bitangent);

  ivec2 guide[SLOTS];
  float share[SLOTS];
  vec2 turn[SLOTS];
  vec3 first_lower = vec3(0.0);
  vec3 first_tip = vec3(0.0);
  float first_length = 0.0;
  float total = 0.0;
  for (int slot = 0; slot < SLOTS; slot++) {
    vec4 pair = texelFetch(bindings, bound + ivec2(2 + slot / 2, 0), 0);
    vec2 weighed = (slot % 2 == 0) ? pair.xy : pair.zw;
    int index = int(weighed.x);
    guide[slot] = strand_texel(index, 0, making.point_count + 1, making.row_segments);
    int row = index / making.row_normals;
    vec3 guide_normal = texelFetch(guide_normals, ivec2(index - row * making.row_normals, row), 0).xyz;
    turn[slot] = frame_turn(guide_normal, tangent, bitangent, normal);
    vec4 shape = texelFetch(segments, guide[slot] + ivec2(making.point_count - 1, 0), 0);
    vec3 lower = turned_by(turn[slot], shape.xyz);
    vec3 tip = turned_by(turn[slot], texelFetch(segments, guide[slot] + ivec2(making.point_count, 0), 0).xyz);
    share[slot] = weighed.y;
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
  }
  for (int slot = 0; slot < SLOTS; slot++) {
    share[slot] /= total;
    turn[slot] *= share[slot];
  }

  // From the surface's frame to the coordinates that are drawn.
  tangent = (making.axes * vec4(tangent, 0.0)).xyz;
  bitangent = (making.axes * vec4(bitangent, 0.0)).xyz;
  normal = (making.axes * vec4(normal, 0.0)).xyz;
  vec3 place = (making.axes * vec4(root, 0.0)).xyz;
  ivec2 here = strand_texel(strand, 0, making.point_count, making.row_strands);
  ivec2 past = strand_texel(strand, 1, making.point_count + 1, making.row_moved);
  vec3 least = place;
  vec3 greatest = place;
  for (int point = 0; point < making.point_count; point++) {
    if (point > 0) {
      vec3 sum = vec3(0.0);
      float mean_length = 0.0;
      for (int slot = 0; slot < SLOTS; slot++) {
        vec4 segment = texelFetch(segments, guide[slot] + ivec2(point - 1, 0), 0);
        sum.xy += turn[slot] * segment.x + vec2(-turn[slot].y, turn[slot].x) * segment.y;
        sum.z += share[slot] * segment.z;
        mean_length += share[slot] * segment.w;
      }
      sum = stretched(sum, mean_length, making.keep_length);
      place += tangent * sum.x + bitangent * sum.y + normal * sum.z;
      least = min(least, place);
      greatest = max(greatest, place);
    }
    if (making.row_moved > 0) {
      imageStore(moved_strands, past + ivec2(point, 0), imageLoad(strands, here + ivec2(point, 0)));
    }
    imageStore(strands, here + ivec2(point, 0), vec4(place, texelFetch(radii, ivec2(point, 0), 0).r));
  }
  ivec2 box = strand_texel(strand, 0, 2, imageSize(boxes).x / 2);
  imageStore(boxes, box, vec4(least, 0.0));
  imageStore(boxes, box + ivec2(1, 0), vec4(greatest, 0.0));
}
