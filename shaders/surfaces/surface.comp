// SPDX-License-Identifier: GPL-3.0-or-later
// Shades surfaces where one of their triangles is nearest. Each thread takes four by four samples. With coarse shading, where
// light has little noise, one of two by two samples of the same part of a surface is shaded for all, another one in each pass.

#include "surfaces/surface_light.glsl"
#include "visibility/surface_hit.glsl"
#include "visibility/sample_values.glsl"

const int SIDE = 4;  // samples along each side of what a thread takes

// How far a sample may be off the plane of another one, as a part of the steps of depth, and by rounding.
const float OFF_PLANE = 0.5;
const float ROUNDING = 2e-7;
// Part of alpha squared that the change of normals within a block may add to it.
const float EVEN = 0.25;
// Variance of light, by that squared, which is left to the mean over blocks and passes.
const float NOISE = 2e-3;

// The triangle of this surface in a sample. Other surfaces, hair and empty samples give numbers beyond its triangles.
uint triangle_at(ivec2 place)
{
  return texelFetch(segments, place, 0).r - (NO_SEGMENT + 1u + uint(first_triangle));
}

// Whether a triangle has the material that is shaded.
bool is_of_part(uint triangle)
{
  return triangle - uint(part_triangle) < uint(triangle_count);
}

float depth_of_sample(ivec2 place)
{
  return uintBitsToFloat(texelFetch(depths, place, 0).r);
}

// Whether a sample of a triangle shows the same part of a surface as another one does: it lies in the plane of that one's
// triangle, and normals have no edge between them.
bool is_alike(ivec2 place, uint triangle, ivec2 other, uint other_triangle, vec2 depth_steps)
{
  float expected = depth_of_sample(other) + dot(vec2(place - other), depth_steps);
  float off = OFF_PLANE * (abs(depth_steps.x) + abs(depth_steps.y)) + ROUNDING;
  bool is_smooth = view.has_vertex_normals != 0 || triangle == other_triangle;
  return is_smooth && abs(depth_of_sample(place) - expected) <= off;
}

// The sample's own light below what is drawn over it.
vec4 below_what_is_over(vec3 light, ivec2 place)
{
  vec4 over = (has_over != 0) ? imageLoad(picture, place) : vec4(0.0);
  return vec4(min(light * (1.0 - over.a) + over.rgb, vec3(BRIGHTEST)), 1.0);
}

// The sample of a thread with a number: those of a pair of rows and columns are next to each other.
ivec2 sample_of(ivec2 corner, int index)
{
  return corner + ivec2((index >> 2 & 1) * 2 + (index & 1), (index >> 3) * 2 + (index >> 1 & 1));
}

// Which sample is shaded first of each two by two: these are all in other rows and columns.
int first_of(int index)
{
  int first = (index >> 2 & 1) * 2 + (index >> 3) + int(4.0 * view.coverage_turn);
  return (index & ~3) | ((index + first) & 3);
}

// The row of this thread. Software drivers give each processor groups that follow each other: they are of rows all over the
// picture, as a surface may be in a part of it.
uint turned_row()
{
  uint group = gl_WorkGroupID.y * uint(row_stride) % gl_NumWorkGroups.y;
  return group * gl_WorkGroupSize.y + gl_LocalInvocationID.y;
}

void main()
{
  ivec2 size = textureSize(segments, 0);
  ivec2 corner = SIDE * ivec2(gl_GlobalInvocationID.x, turned_row()) + ivec2(window_left, window_bottom);
  // Two by two samples are those of the whole picture.
  corner -= picture_place(corner) & (SIDE - 1);
  int waiting = 0;  // a bit for each sample
  for (int index = 0; index < SIDE * SIDE; index++) {
    ivec2 place = sample_of(corner, index);
    bool is_inside = all(greaterThanEqual(place, ivec2(0))) && all(lessThan(place, size));
    waiting |= (is_inside && is_of_part(triangle_at(place))) ? 1 << index : 0;
  }
  bool is_first = true;
  bool is_quiet = false;
  while (waiting != 0) {
    int turn = 0;
    while ((waiting >> first_of(turn) & 1) == 0) {
      turn++;
    }
    int shown = first_of(turn);
    ivec2 place = sample_of(corner, shown);
    uint triangle = triangle_at(place);
    vec2 depth_steps;
    SurfacePoint point = found_point(int(triangle), vec2(place) + 0.5, vec2(size), depth_steps);
    if (is_coarse != 0) {
      // Images are averaged over the samples that take their light from this one.
      point.uv_right *= 2.0;
      point.uv_up *= 2.0;
    }
    SurfaceLight light_here = surface_light(point, sample_turn(picture_place(place)));
    vec3 light = light_here.below + light_here.highlight;
    waiting &= ~(1 << shown);
    imageStore(picture, place, below_what_is_over(light, place));

    // Highlights so small that they change from sample to sample are shaded in each.
    bool is_even = 8.0 * point.normal_variance <= EVEN * light_here.alpha * light_here.alpha;
    if (is_quiet && is_even) {
      for (int next = 1; next < 4; next++) {
        int index = (shown & ~3) | ((shown + next) & 3);
        ivec2 beside = sample_of(corner, index);
        if ((waiting >> index & 1) != 0 && is_alike(beside, triangle_at(beside), place, triangle, depth_steps)) {
          imageStore(picture, beside, below_what_is_over(light, beside));
          waiting &= ~(1 << index);
        }
      }
    }
    // The first sample only estimates the noise, and its light is not shared: samples that happen to miss the hair have no
    // noise, so sharing them would bias the light.
    is_quiet = is_first ? is_coarse != 0 && light_here.noise <= NOISE : is_quiet;
    is_first = false;
  }
}
