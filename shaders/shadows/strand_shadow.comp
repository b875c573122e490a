// SPDX-License-Identifier: GPL-3.0-or-later
// Rasterizes strands into the deep opacity maps of several lights: first the nearest and farthest depths (IS_FRONT), then the
// counts of each layer in between. The images of maps that are drawn together are stacked.

#include "shadows/opacity.glsl"
#include "visibility/segment.glsl"

vec2 end_depths;

float depth_of(vec3 point)
{
  Light light = lights.light[view.light_index];
  vec3 place = (view.object_to_world * vec4(point, 1.0)).xyz;
  return light_depth(light.kind, light.position.xyz, light.axis.xyz, light.near, light.extent, place);
}

void begin(int strand, int piece, Segment segment, vec4 first, vec4 second)
{
  end_depths = mix(vec2(depth_of(first.xyz)), vec2(depth_of(second.xyz)), segment.part);
}

bool is_left_out(int run)
{
  return false;
}

void end_run(int run) {}

// Occlusion by surfaces is tested per sample only.
bool is_hidden(ivec2 low, ivec2 high, float first_along, float last_along)
{
  return false;
}

void meet(ivec2 seen_place, float along, float across, float coverage)
{
  float depth = mix(end_depths.x, end_depths.y, clamp(along, 0.0, 1.0));
  int shadow_layer = lights.light[view.light_index].shadow_layer;
  float hidden = texelFetch(hidden_depth, ivec3(seen_place, shadow_layer), 0).r;
  ivec2 place = seen_place + ivec2(0, object_layer * imageSize(fronts).x);
  if (IS_FRONT) {
    if (depth > hidden) {
      return;
    }
    uint bits = front_bits(depth);
    if (bits < imageLoad(fronts, place).r) {
      imageAtomicMin(fronts, place, bits);
    }
    if (bits > imageLoad(backs, place).r) {
      imageAtomicMax(backs, place, bits);
    }
  }
  else {
    vec2 ends = texelFetch(hair_front, ivec3(seen_place, shadow_layer), 0).rg;
    int layer = layer_among(depth, ends, hidden);
    if (layer > 3) {
      return;
    }
    imageAtomicAdd(counts, ivec2(place.x * 4 + layer, place.y), uint(coverage * COUNT_UNIT + 0.5));
  }
}

const bool HAS_TILES = false;

#include "visibility/rasterize_segment.glsl"

void main()
{
  walk_run(ivec2(imageSize(fronts).x));
}
