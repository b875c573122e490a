// SPDX-License-Identifier: GPL-3.0-or-later
// A pass of data of strands.

#include "picture/data_value.glsl"
#include "visibility/coverage.glsl"
#include "visibility/strand_hit.glsl"

// Where a sample is relative to the axis of its strand, in its radii: on the right of the tangent, and beyond the end of the
// strand along it. As in visibility/rasterize_segment.glsl, which jitters the samples of thin strands.
vec2 place_beside(vec2 at)
{
  vec2 extent = abs(drawn_segment.end.xy - drawn_segment.start.xy);
  bool is_steep = extent.y > extent.x;
  vec2 start = is_steep ? drawn_segment.start.yx : drawn_segment.start.xy;
  vec2 way = (is_steep ? drawn_segment.end.yx : drawn_segment.end.xy) - start;
  vec2 place = is_steep ? at.yx : at;
  way.x = (abs(way.x) < 1e-4) ? 1e-4 : way.x;
  float slope = way.y / way.x;
  float beyond = place.x - start.x;
  vec2 widths = drawn_segment.half_width;
  float along = beyond / way.x;
  float half_width = max(mix(widths.x, widths.y, clamp(along, 0.0, 1.0)), 1e-6);
  float middle = start.y + beyond * slope;
  ivec2 first = is_steep ? ivec2(view.first_row, view.first_column) : ivec2(view.first_column, view.first_row);
  float row = float(first.y) + middle;
  float offset = sample_offset(first.x + int(place.x), row, offset_turn(view.coverage_turn));
  middle -= view.sample_offset * offset_share(half_width) * offset;
  vec2 found;
  found.x = clamp((place.y - middle) / (half_width * sqrt(1.0 + slope * slope)), -1.0, 1.0);
  found.x = (is_steep == (way.x > 0.0)) ? found.x : -found.x;
  // Along the axis up to the point next to the sample.
  along += (place.y - middle) * slope / ((1.0 + slope * slope) * way.x);
  float limit = sqrt(1.0 - found.x * found.x);
  found.y = clamp((along - clamp(along, 0.0, 1.0)) * length(way) / half_width, -limit, limit);
  return found;
}

vec4 sample_value()
{
  vec3 to_eye = (view.is_perspective != 0) ? view.eye.xyz - drawn_position : view.eye.xyz;
  to_eye = normalize(to_eye);
  vec3 beside = cross(strand_tangent, to_eye);
  float sine = length(beside);
  beside /= max(sine, 1e-15);
  vec2 place = place_beside(sample_at);
  float across = place.x * ((view.is_mirrored != 0) ? -1.0 : 1.0);
  float facing = sqrt(max(1.0 - dot(place, place), 0.0));
  bool is_round_end = place.y != 0.0 && (strand_position == 0.0 || strand_position == 1.0);
  // On the ray of the sample, at its depth.
  vec3 beyond = is_round_end ? place.y * cross(to_eye, beside) : vec3(0.0);
  float rise = facing / (is_round_end ? 1.0 : max(sine, LEAST_SINE));
  SampleData found;
  found.N = across * beside + beyond + facing * (is_round_end ? to_eye : cross(beside, strand_tangent));
  found.position = drawn_position + drawn_radius * (across * beside + beyond + rise * to_eye);
  found.diffuse = vec3(0.0);
  found.albedo = view.hair_reflectance.rgb;
  ivec2 texel = ivec2(strand_index % view.row_strands, strand_index / view.row_strands);
  found.uv = (data.has_uvs != 0) ? texelFetch(root_uvs, texel, 0).xy : vec2(0.0);
  return data_value(found);
}

#include "visibility/strand_samples.glsl"
