// SPDX-License-Identifier: GPL-3.0-or-later
// Reprojects the previous picture of a viewport [Karis14], and computes its weight in passes. Clamping each pixel to its
// neighbors would remove thin strands, which are in few samples of a pass. Means of blocks are compared instead: they may
// differ as far as noise allows.

#include "picture/history_noise.glsl"
#include "visibility/sample_values.glsl"

// Maximum weights in passes.
const float MOST_OF_BACKGROUND = 1.0;  // without hair and surfaces nearby: no noise, and possibly uncovered just now
const float MOST_OF_LIT_SURFACE = 24.0;  // if only lights move: shadows move over surfaces, and would leave a trail
const float SLOW = 4.0;  // pixels per frame: at higher speed the weight decreases, as occlusion between strands changes

// Number of standard errors by which the means of two blocks may differ.
const float TOLERANCE = 2.0;
const float MOST_GAIN = 8.0;  // of lit samples: more light than that is added to all strands alike, also to dark strands
const float TOLERANCE_OF_LIGHT = 3.0;  // if only lights have moved

// Origin of the textures of samples in the picture. There is no hair outside of them.
ivec2 first_place()
{
  return ivec2(history.first_column, history.first_row);
}

// Position [pixels] in the previous picture of the nearest geometry in or beside a pixel. is_background: there is no geometry.
vec2 place_before(ivec2 pixel, out bool is_background)
{
  int nearest_place = int(texelFetch(places, pixel, 0).r);
  int columns = textureSize(depths, 0).x;
  ivec2 place = ivec2(nearest_place % columns, nearest_place / columns);
  float nearest = uintBitsToFloat(texelFetch(depths, place, 0).r);
  is_background = nearest == 1.0;
  vec2 at = vec2(pixel) + 0.5;
  if (texelFetch(segments, place, 0).r < NO_SEGMENT) {
    if (history.has_hair_motion != 0) {
      return at + texelFetch(hair_motion, pixel, 0).xy;
    }
  }
  else if (history.has_surface_motion != 0 && !is_background) {
    return at + texelFetch(surface_motion, place, 0).xy;
  }
  vec4 clip = history.now_to_before * vec4(2.0 * at / history.size.xy - 1.0, 2.0 * nearest - 1.0, 1.0);
  return (clip.w > 0.0) ? (0.5 * clip.xy / clip.w + 0.5) * history.size.xy : vec2(-1.0);
}

// The previous picture at a position [pixels], by Catmull-Rom interpolation, as bilinear filtering would blur it more with
// each frame. Uses five bilinear samples, as the corners' weights are small. Values beside bright strands may be negative:
// they are only clamped for display, as clamping in each frame would accumulate light.
vec4 previous_at(vec2 place)
{
  vec2 middle = floor(place - 0.5) + 0.5;
  vec2 t = place - middle;
  vec2 before_it = t * (-0.5 + t * (1.0 - 0.5 * t));
  vec2 first = 1.0 + t * t * (-2.5 + 1.5 * t);
  vec2 second = t * (0.5 + t * (2.0 - 1.5 * t));
  vec2 after_it = t * t * (-0.5 + 0.5 * t);
  vec2 inner = first + second;
  vec2 texel = 1.0 / history.size.xy;
  vec2 low = (middle - 1.0) * texel;
  vec2 between = (middle + second / inner) * texel;
  vec2 high = (middle + 2.0) * texel;
  vec4 total = textureLod(before, between, 0.0) * (inner.x * inner.y);
  total += textureLod(before, vec2(low.x, between.y), 0.0) * (before_it.x * inner.y);
  total += textureLod(before, vec2(high.x, between.y), 0.0) * (after_it.x * inner.y);
  total += textureLod(before, vec2(between.x, low.y), 0.0) * (inner.x * before_it.y);
  total += textureLod(before, vec2(between.x, high.y), 0.0) * (inner.x * after_it.y);
  float weight = inner.x * inner.y + (before_it.x + after_it.x) * inner.y + inner.x * (before_it.y + after_it.y);
  return total / weight;
}

// Mean light and coverage of the samples around a position, before and now. The samples are the same, so that their choice
// of strands is not noise in the change [Schied18].
void light_around(vec2 place, out vec4 earlier, out vec3 later)
{
  ivec2 blocks = textureSize(light_now, 0);
  vec2 at = block_place(place * float(history.samples_per_side) - vec2(first_place()), blocks);
  earlier = vec4(0.0);
  later = vec3(0.0);
  for (int turn = 0; turn < 4; turn++) {
    vec2 beside = at + (vec2(turn & 1, turn >> 1) - 0.5) / vec2(blocks);
    earlier += 0.25 * textureLod(light_before, beside, 0.0);
    later += 0.25 * textureLod(light_now, beside, 0.0).rgb;
  }
}

// Whether hair is in samples of a pixel or up to four pixels away, as a thin strand is in few samples.
bool is_near_hair(ivec2 pixel)
{
  int side = history.samples_per_side;
  ivec2 last = textureSize(segments, 0) - 1;
  bool is_found = false;
  for (int turn = 0; turn < 25 && !is_found; turn++) {
    ivec2 place = (pixel + 2 * ivec2(turn % 5, turn / 5) - 4) * side - first_place();
    place = clamp(place, ivec2(0), last);
    is_found = texelFetch(segments, place, 0).r < NO_SEGMENT;
  }
  return is_found;
}

// The previous picture at a pixel; passes: its weight, 0 for none.
vec4 carried_light(ivec2 pixel, out float passes)
{
  ivec2 blocks = textureSize(now_mean, 0);
  vec2 here = block_place(vec2(pixel) + 0.5, blocks);
  vec4 mean = textureLod(now_mean, here, 0.0);
  passes = 0.0;
  bool is_still = history.is_still != 0;
  bool is_background = false;
  bool is_hair_alone = is_still && (history.has_lit_surfaces == 0 || is_near_hair(pixel));
  vec2 place = is_still ? vec2(pixel) + 0.5 : place_before(pixel, is_background);
  if (any(lessThan(place, vec2(0.0))) || any(greaterThan(place, history.size.xy))) {
    return vec4(0.0);
  }
  vec2 there = block_place(place, blocks);
  vec4 mean_before = textureLod(before_mean, there, 0.0);
  vec4 deviation = textureLod(now_deviation, here, 0.0);
  if (!is_background) {  // after hair has moved away, its former noise must not keep it in the picture
    deviation = max(deviation, textureLod(before_deviation, there, 0.0));
  }
  vec4 light = previous_at(place);
  float tolerance = TOLERANCE;
  if (is_still) {
    vec4 earlier;
    vec3 later;
    light_around(place, earlier, later);
    vec3 change = later / max(earlier.rgb, vec3(1e-6));
    vec3 gain = min(change, vec3(MOST_GAIN));
    vec3 more = max(later - gain * earlier.rgb, vec3(0.0)) / max(earlier.a, 1e-3);
    light.rgb = gain * light.rgb + more * light.a;
    mean_before.rgb = gain * mean_before.rgb + more * mean_before.a;
  }
  if (is_hair_alone) {
    // Coverage of a block by hair is noise; only light may have changed.
    mean *= mean_before.a / max(mean.a, 0.25 * mean_before.a + 1e-4);
    tolerance = TOLERANCE_OF_LIGHT;
  }
  // Half floats resolve a thousandth.
  vec4 bound = (tolerance / float(BLOCK_SIDE)) * deviation + 2e-3 * (mean + mean_before) + 1e-5;
  vec4 allowed = clamp(mean_before, mean - bound, mean + bound);
  // Scaled in proportion, so that black beside a bright edge stays black.
  vec4 factor = clamp(allowed / max(mean_before, vec4(1e-6)), vec4(0.0), vec4(2.0));
  light *= is_hair_alone ? vec4(factor.rgb, 1.0) : factor;
  vec4 excess = abs(mean_before - mean) / bound;
  float most = max(max(excess.r, excess.g), max(excess.b, excess.a));
  passes = textureLod(before_passes, place / history.size.xy, 0.0).r;
  float most_passes = (is_still && !is_hair_alone) ? MOST_OF_LIT_SURFACE : history.most_passes;
  passes = min(passes, is_background ? MOST_OF_BACKGROUND : most_passes) / max(0.5 * most, 1.0);
  passes /= max(distance(place, vec2(pixel) + 0.5) / SLOW, 1.0);
  return light;
}

void main()
{
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, imageSize(colors)))) {
    return;
  }
  float passes = 0.0;
  vec4 light = vec4(0.0);
  if (has_noise(pixel / BLOCK_SIDE)) {
    light = carried_light(pixel, passes);
  }
  imageStore(colors, pixel, light);
  imageStore(weights, pixel, vec4(passes));
}
