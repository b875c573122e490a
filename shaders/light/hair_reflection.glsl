// SPDX-License-Identifier: GPL-3.0-or-later
// Light of a lamp that hair reflects to a surface beside it: shadow maps hold the hair's lit side, which is taken for a matt
// surface that sends light in turn [Dachsbacher05]. Needs the samplers of shadows/shadow.glsl.

#include "shadows/shadow.glsl"

// Distances across the light at which hair is looked up, least and largest, as parts of the hair's extent; how often they go
// through this range in half a turn: with five in a turn, places of samples next to each other are even in both.
const float NEAREST = 0.015;
const float FARTHEST = 0.45;
const float TURNS = 2.5;
const int PLACES = 4;  // of each sample
// Distance of neighbors that tell the slope of the hair's lit side, as a part of the map; and the largest difference of
// their depths: beyond it they are of different locks.
const float SLOPE_REACH = 0.012;
const float SLOPE_LIMIT = 0.06;

// Places across a light's direction, for distances in meters.
struct Across {
  vec3 right;
  vec3 up;
  float scale;  // of the map, times the distance to the light's plane
  float w;
};

Across across_of(Light light, vec3 position)
{
  mat4 m = light.world_to_shadow;
  vec3 right = vec3(m[0][0], m[1][0], m[2][0]);
  vec3 up = vec3(m[0][1], m[1][1], m[2][1]);
  Across across;
  across.right = normalize(right);
  across.up = normalize(up);
  across.scale = 0.5 * length(right);
  across.w = dot(vec4(m[0][3], m[1][3], m[2][3], m[3][3]), vec4(position, 1.0));
  return across;
}

// Normal of the hair's lit side at a place of the map with strands at a depth; meters: of the map's size there.
vec3 lit_side_normal(vec3 place, float front, float extent, float meters, Across across, vec3 L)
{
  float right = textureLod(hair_front, place + vec3(SLOPE_REACH, 0.0, 0.0), 0.0).r - front;
  float up = textureLod(hair_front, place + vec3(0.0, SLOPE_REACH, 0.0), 0.0).r - front;
  vec2 slope = vec2(abs(right) < SLOPE_LIMIT ? right : 0.0, abs(up) < SLOPE_LIMIT ? up : 0.0);
  slope *= extent / (SLOPE_REACH * meters);
  return normalize(L + slope.x * across.right + slope.y * across.up);
}

// Irradiance of a surface with a normal N by light from one place of the map, as a part of the light's on a small ball.
// turn: the direction of the place from this one, in the map; part: how far it is, from 0 to 1; the rest as below.
vec3 reflection_of_place(
    Light light, Across across, vec3 at, float depth, vec3 N, vec3 L, vec2 turn, float part)
{
  // As many places at each distance as light that falls with its square needs.
  float range = log(FARTHEST / NEAREST);
  float away = NEAREST * light.extent * exp(range * part);
  vec2 offset = turn * away;
  float map_meters = across.w / across.scale;
  vec3 place = at + vec3(offset / map_meters, 0.0);
  vec2 ends = textureLod(hair_front, place, 0.0).rg;
  float beyond = (ends.x - depth) * light.extent;
  float widening = (light.kind == LIGHT_SUN) ? 1.0 : max(1.0 + beyond / across.w, 0.25);
  vec3 way = widening * (offset.x * across.right + offset.y * across.up) - beyond * L;
  float facing = dot(N, way);
  if (facing <= 0.0 || ends.x > 1.0 || place.xy != clamp(place.xy, vec2(0.0), vec2(1.0))) {
    return vec3(0.0);
  }
  float sent = -dot(lit_side_normal(place, ends.x, light.extent, widening * map_meters, across, L), way);
  if (sent <= 0.0) {
    return vec3(0.0);
  }
  float squared = dot(way, way);
  float weight = 2.0 * range * away * away / squared;  // over the density of the places, and pi
  float count = textureLod(hair_layers, place, 0.0)[layer_of(ends.y - ends.x)];
  return reflected_by_hair(count) * (facing * sent * weight / squared);
}

// Square of a color's mean over its channels.
float squared_mean(vec3 value)
{
  float mean = dot(value, vec3(1.0 / 3.0));
  return mean * mean;
}

// Variance of the mean of values with a sum and a sum of `squared_mean`.
float variance_of_mean(vec3 sum, float squares, int count)
{
  float number = float(count);
  return max(squares - squared_mean(sum) / number, 0.0) / (number * number);
}

// The same of all hair beside it: of places in four directions and at four distances of their range, which are
// others in each pass. at, depth: of `shadow_place`; L: towards the light; turn: of `sample_turn`; variance: of the result, in
// the mean of its channels.
vec3 hair_reflection(
    Light light, Across across, vec3 at, float depth, vec3 N, vec3 L, vec2 turn, out float variance)
{
  variance = 0.0;
  if (view.hair_reflectance.rgb == vec3(0.0)) {
    return vec3(0.0);  // a model without light between strands
  }
  float part = TURNS * atan(turn.y, turn.x) / PI;
  vec3 light_there = vec3(0.0);
  float squares = 0.0;
  for (int place = 0; place < PLACES; place++) {
    vec3 light_of_place = reflection_of_place(light, across, at, depth, N, L, turn, fract(part));
    light_there += light_of_place;
    squares += squared_mean(light_of_place);
    turn = vec2(-turn.y, turn.x);
    part += 1.0 / float(PLACES);
  }
  // Where hair shades a surface, its lit side is on the other side.
  float open = exp(-crossed_before_surface(at, depth));
  variance = variance_of_mean(light_there, squares, PLACES) * open * open;
  return light_there * (open / float(PLACES));
}
