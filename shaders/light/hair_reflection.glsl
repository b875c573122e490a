// SPDX-License-Identifier: GPL-3.0-or-later
// Light of a lamp that hair reflects to a surface nearby: shadow maps contain the hair's lit side, which is treated as a
// matte surface that emits reflected light [Dachsbacher05]. Needs the samplers of shadows/shadow.glsl.

#include "shadows/shadow.glsl"

// Minimum and maximum distance across the light at which hair is looked up, as fractions of the hair's extent; and how often
// distances repeat this range in half a turn: with five times per turn, lookups of adjacent samples are even in both.
const float NEAREST = 0.015;
const float FARTHEST = 0.45;
const float TURNS = 2.5;
const int PLACES = 4;  // lookups per sample
// Distance of neighbors for the slope of the hair's lit side, as a fraction of the map; and the largest difference of their
// depths: beyond it they are in different locks.
const float SLOPE_REACH = 0.012;
const float SLOPE_LIMIT = 0.06;

// Axes across a light's direction, for distances in meters.
struct Across {
  vec3 right;
  vec3 up;
  float scale;  // of the map, times the distance from the light's plane
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

// Normal of the hair's lit side at a place of the map with strands at depth `front`; meters: size of the map there.
vec3 lit_side_normal(vec3 place, float front, float extent, float meters, Across across, vec3 L)
{
  float right = textureLod(hair_front, place + vec3(SLOPE_REACH, 0.0, 0.0), 0.0).r - front;
  float up = textureLod(hair_front, place + vec3(0.0, SLOPE_REACH, 0.0), 0.0).r - front;
  vec2 slope = vec2(abs(right) < SLOPE_LIMIT ? right : 0.0, abs(up) < SLOPE_LIMIT ? up : 0.0);
  slope *= extent / (SLOPE_REACH * meters);
  return normalize(L + slope.x * across.right + slope.y * across.up);
}

// Irradiance of a surface with normal N by hair at one place of the map, relative to the light's irradiance of a small ball.
// turn: direction to the place in the map; part: its distance, from 0 to 1; the rest as for `hair_reflection`.
vec3 reflection_of_place(
    Light light, Across across, vec3 at, float depth, vec3 N, vec3 L, vec2 turn, float part)
{
  // Distances are distributed for light that falls off with their square.
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
  float weight = 2.0 * range * away * away / squared;  // divided by the density of places, and by pi
  float count = textureLod(hair_layers, place, 0.0)[layer_of(ends.y - ends.x)];
  return reflected_by_hair(count) * (facing * sent * weight / squared);
}

// Square of the mean of a color's channels.
float squared_mean(vec3 value)
{
  float mean = dot(value, vec3(1.0 / 3.0));
  return mean * mean;
}

// Variance of the mean of `count` values; sum, squares: sums of the values and of their `squared_mean`.
float variance_of_mean(vec3 sum, float squares, int count)
{
  float number = float(count);
  return max(squares - squared_mean(sum) / number, 0.0) / (number * number);
}

// The same by all nearby hair: places in four directions and at four distances, which differ in each pass. at, depth: from
// `shadow_place`; L: towards the light; turn: from `sample_turn`; variance: of the result's mean over its channels.
vec3 hair_reflection(
    Light light, Across across, vec3 at, float depth, vec3 N, vec3 L, vec2 turn, out float variance)
{
  variance = 0.0;
  if (view.hair_reflectance.rgb == vec3(0.0)) {
    return vec3(0.0);  // models without multiple scattering
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
  // If hair shades a surface, its lit side faces away from the surface.
  float open = exp(-crossed_before_surface(at, depth));
  variance = variance_of_mean(light_there, squares, PLACES) * open * open;
  return light_there * (open / float(PLACES));
}
