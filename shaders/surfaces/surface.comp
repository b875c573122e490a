// SPDX-License-Identifier: GPL-3.0-or-later
// Shades samples in which a triangle of the surface is nearest, four by four per thread. With coarse shading, if light has
// little noise, one of two by two samples of the same part of a surface is shaded for all, alternating with each pass.

#include "surfaces/surface_light.glsl"
#include "visibility/surface_hit.glsl"
#include "visibility/sample_values.glsl"

const int SIDE = 4;  // samples along each side of a thread's block

// Maximum distance of a sample from the plane of another, as a fraction of the depth steps, and by rounding.
const float OFF_PLANE = 0.5;
const float ROUNDING = 2e-7;
// Fraction of alpha squared that the change of normals within a block may add.
const float EVEN = 0.25;
// Variance relative to squared light that the mean over blocks and passes may reduce.
const float NOISE = 2e-3;

// The triangle of this surface in a sample. Other surfaces, hair and empty samples result in numbers beyond its triangles.
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

// Whether a sample shows the same part of a surface as another: it lies in the plane of the other's triangle, and normals
// have no edge between them.
bool is_alike(ivec2 place, uint triangle, ivec2 other, uint other_triangle, vec2 depth_steps)
{
  float expected = depth_of_sample(other) + dot(vec2(place - other), depth_steps);
  float off = OFF_PLANE * (abs(depth_steps.x) + abs(depth_steps.y)) + ROUNDING;
  bool is_smooth = view.has_vertex_normals != 0 || triangle == other_triangle;
  return is_smooth && abs(depth_of_sample(place) - expected) <= off;
}

// The light of a sample, composited below clear surfaces and holdouts.
vec4 below_what_is_over(vec3 light, ivec2 place)
{
  vec4 over = (has_over != 0) ? imageLoad(picture, place) : vec4(0.0);
  return vec4(min(light * (1.0 - over.a) + over.rgb, vec3(BRIGHTEST)), 1.0);
}

// The sample of a thread with an index: samples of two by two are consecutive.
ivec2 sample_of(ivec2 corner, int index)
{
  return corner + ivec2((index >> 2 & 1) * 2 + (index & 1), (index >> 3) * 2 + (index >> 1 & 1));
}

// The sample of each two by two that is shaded first: these are all in different rows and columns.
int first_of(int index)
{
  int first = (index >> 2 & 1) * 2 + (index >> 3) + int(4.0 * view.coverage_turn);
  return (index & ~3) | ((index + first) & 3);
}

// The row of this thread. Software drivers give consecutive groups to each processor: their rows are spread over the picture,
// as a surface may only be in a part of it.
uint turned_row()
{
  uint group = gl_WorkGroupID.y * uint(row_stride) % gl_NumWorkGroups.y;
  return group * gl_WorkGroupSize.y + gl_LocalInvocationID.y;
}

void main()
{
  ivec2 size = textureSize(segments, 0);
  ivec2 corner = SIDE * ivec2(gl_GlobalInvocationID.x, turned_row()) + ivec2(window_left, window_bottom);
  // Blocks are aligned to the whole picture.
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
      // Images are averaged over the samples that share this light.
      point.uv_right *= 2.0;
      point.uv_up *= 2.0;
    }
    SurfaceLight light_here = surface_light(point, sample_turn(picture_place(place)));
    vec3 light = light_here.below + light_here.highlight;
    waiting &= ~(1 << shown);
    imageStore(picture, place, below_what_is_over(light, place));

    // Highlights that vary between samples are shaded in each sample.
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
