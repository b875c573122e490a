// SPDX-License-Identifier: GPL-3.0-or-later
// Light of a lamp on a surface, past other surfaces and through hair. Light between strands casts shadows whose softness
// follows from the lamp's size; light through strands leaves the hair in all directions and is spread over the surface by
// its distance. Needs the samplers of shadows/shadow.glsl.

#include "light/hair_reflection.glsl"

const int TAP_COUNT = 4;
// Distance of hair from the surface, as a fraction of the hair's extent: the first guess, and the maximum.
const float FIRST_DISTANCE = 0.06;
const float LARGEST_DISTANCE = 0.25;
// Surfaces that face away from the light more than this get no light through hair.
const float LEAST_COSINE = -0.3;

// Noise from 0 to 1 that is evenly distributed over any few adjacent samples: interleaved gradient noise [Jimenez14].
float gradient_noise(vec2 place)
{
  return fract(52.9829189 * fract(dot(place, vec2(0.06711056, 0.00583715))));
}

// Mean of the positive cosines between a normal and the directions to a disk; cosine: to its center; sine: of its angular
// radius.
float disk_cosine(float cosine, float sine)
{
  float above = max(cosine + sine, 0.0);
  return (cosine >= sine) ? cosine : 0.25 * above * above / max(sine, 1e-4);
}

// White noise from 0 to 1 for a block of the picture.
float part_noise(ivec2 part)
{
  uint bits = uint(part.x) * 1597334677u ^ uint(part.y) * 3812015801u;
  bits = (bits ^ (bits >> 15u)) * 747796405u;
  return float(bits >> 8u) / 16777216.0;
}

// Position of a sample in the whole picture.
ivec2 picture_place(ivec2 place)
{
  return place + ivec2(view.first_column, view.first_row);
}

// A direction for lookups at a position in the picture, which differs in each pass: blocks of 4 × 4 samples have evenly
// distributed noise, offset randomly for each block, as a single pattern would leave stripes with several samples per pass.
vec2 sample_turn(ivec2 place)
{
  float angle = 2.0 * PI * fract(gradient_noise(vec2(place & 3)) + part_noise(place >> 2) + view.coverage_turn);
  return vec2(cos(angle), sin(angle));
}

// Irradiance of a surface, relative to a small ball.
struct SurfaceVisibility {
  float past_surfaces;  // past surfaces only
  vec3 past_hair;  // past surfaces and hair
  float variance;  // of the mean of `past_hair`, by the choice of lookups
};

// N: the surface's normal; forward: fraction that a strand passes on; turn: from `sample_turn`.
SurfaceVisibility surface_visibility(Light light, vec3 position, vec3 N, vec3 forward, vec2 turn)
{
  SurfaceVisibility seen;
  vec3 L = to_light(light.kind, light.position.xyz, light.axis.xyz, position);
  float cosine = dot(N, L);
  float tangent = 2.0 * sqrt(light_blur(light.kind, light.position.xyz, light.radius, position));
  float direct = disk_cosine(cosine, tangent * inversesqrt(1.0 + tangent * tangent));
  float wide = wide_lit_part(light, position);
  seen.past_surfaces = direct * wide;
  seen.past_hair = vec3(direct * wide);
  seen.variance = 0.0;
  vec3 at;
  float depth;
  if (!shadow_place(light, position, at, depth)) {
    return seen;
  }
  Across across = across_of(light, position);
  float variance;
  vec3 reflected = hair_reflection(light, across, at, depth, N, L, turn, variance);
  seen.past_hair += reflected;
  seen.variance = variance;
  if (cosine < LEAST_COSINE) {
    return seen;
  }
  float texel = 1.0 / float(textureSize(hair_front, 0).x);
  vec2 aside = turn;
  float away = FIRST_DISTANCE;
  // The maps of surfaces are blurred already, and lookups beside the position would be at other depths.
  // The hair's maps limit the depth of surfaces behind the hair: the mean around that limit is nearer than the surface.
  float far = (light.wide_layer < 0) ? 0.0 : smoothstep(FAR_SURFACE - 0.2, FAR_SURFACE - 0.1, depth);
  float lit = mix(wide, lit_part(at, depth, SURFACE_BIAS), inside_part(at.xy) * (1.0 - far));
  vec3 sum = vec3(0.0);
  float squares = 0.0;
  for (int tap = 0; tap < TAP_COUNT; tap++) {
    float part = (float(tap) + 0.5) / float(TAP_COUNT);
    aside = vec2(-aside.y, aside.x);
    float meters = away * light.extent;
    vec3 found = vec3(0.0);
    float reach = meters * across.scale / max(across.w - meters, 0.25 * across.w);
    if (direct > 0.0) {
      vec3 near = at + vec3(aside * (sqrt(part) * max(tangent * reach, texel)), 0.0);
      found += direct * lit * exp(-crossed_before_surface(near, depth));
    }
    // Half of the light of a uniform sheet of hair arrives within 45 degrees.
    float spread = sqrt(part / (1.0 - part));
    vec2 offset = aside * (spread * reach);
    vec2 ends = textureLod(hair_front, at + vec3(offset, 0.0), 0.0).rg;
    if (ends.x < min(depth, 1.0)) {
      // Cosine of the direction to the hair, relative to the cosine between that direction and the light's.
      float scattered = max(dot(N, L + spread * (aside.x * across.right + aside.y * across.up)), 0.0);
      scattered *= lit_part(at + vec3(0.5 * offset, 0.0), depth - 0.5 * away, SURFACE_BIAS);
      float count = crossed_before_surface(at + vec3(offset, 0.0), depth);
      found += scattered * (transmitted(count, forward) - exp(-count));
      away = clamp(depth - ends.y, 0.0, LARGEST_DISTANCE);
    }
    sum += found;
    squares += squared_mean(found);
  }
  seen.past_surfaces = direct * lit;
  seen.past_hair = sum / float(TAP_COUNT) + reflected;
  seen.variance += variance_of_mean(sum, squares, TAP_COUNT);
  return seen;
}
