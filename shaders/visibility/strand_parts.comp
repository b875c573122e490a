// SPDX-License-Identifier: GPL-3.0-or-later
// Parts of samples that strands cover, without finding the nearest: thinner and more strands than have depths and light.

#include "visibility/segment.glsl"

vec2 end_depths;  // of the axis
vec2 end_rises;  // difference of depth to the side that faces the viewer

bool is_left_out(int run)
{
  return false;
}

void end_run(int run) {}

void begin(int strand, int piece, Segment segment, vec4 first, vec4 second)
{
  end_depths = vec2(segment.start.z, segment.end.z);
  end_rises = depth_rises(segment, distance(first.xyz, second.xyz));
}

bool is_hidden(ivec2 low, ivec2 high, float first_along, float last_along)
{
  return false;
}

void meet(ivec2 place, float along, float across, float coverage) {}

const bool HAS_TILES = false;

#include "visibility/rasterize_segment.glsl"

void main()
{
  walk_run(imageSize(depths));
}
