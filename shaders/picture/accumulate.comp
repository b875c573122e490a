// SPDX-License-Identifier: GPL-3.0-or-later
// Adds a pass, with several samples per pixel, to the sum of passes: mean light, and the depth of the nearest sample. The first
// pass replaces both. `spread`: share of each neighboring pixel along an axis.

// How much nearer than a surface its shadow is drawn, as a fraction of its distance.
const float SHADOW_BIAS = 1e-3;

// Depth of a sample: alpha is one for hair, and less for the black shadow of hair on a surface.
float depth_of(ivec2 sample_place, float alpha)
{
  if (alpha == 1.0) {
    return uintBitsToFloat(texelFetch(depths, sample_place, 0).r);
  }
  float depth = texelFetch(surface_depth, sample_place, 0).r;
  return depth - SHADOW_BIAS * (1.0 - depth);
}

// Depth of a sample, 1 without hair or its shadow.
float seen_depth(ivec2 sample_place, float alpha)
{
  return (alpha > 0.0) ? depth_of(sample_place, alpha) : 1.0;
}

// Adds the samples around a sample, for passes with one sample per pixel, to the total of its pixel.
void share(ivec2 place, ivec2 last, inout vec4 total, inout float nearest)
{
  float own = 1.0 - 2.0 * spread;
  total *= own * own;
  for (int turn = 0; turn < 9; turn++) {
    ivec2 offset = ivec2(turn % 3 - 1, turn / 3 - 1);
    float part = ((offset.x == 0) ? own : spread) * ((offset.y == 0) ? own : spread);
    part = (turn == 4) ? 0.0 : part;
    total += part * texelFetch(picture, clamp(place + offset, ivec2(0), last), 0);
  }
  // A loop without turns costs software drivers nothing, unlike a branch.
  int turns = (nearest == 1.0 && total.a > 0.0) ? 9 : 0;
  for (int turn = 0; turn < turns; turn++) {
    ivec2 beside = clamp(place + ivec2(turn % 3 - 1, turn / 3 - 1), ivec2(0), last);
    nearest = min(nearest, seen_depth(beside, texelFetch(picture, beside, 0).a));
  }
}

void main()
{
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, imageSize(sums)))) {
    return;
  }
  ivec2 corner = pixel * samples_per_side - first_place;
  ivec2 last = textureSize(picture, 0) - samples_per_side;
  vec4 total = vec4(0.0);
  float nearest = 1.0;
  if (all(greaterThanEqual(corner, ivec2(0))) && all(lessThanEqual(corner, last))) {
    for (int y = 0; y < samples_per_side; y++) {
      for (int x = 0; x < samples_per_side; x++) {
        vec4 hair = texelFetch(picture, corner + ivec2(x, y), 0);
        total += hair;
        nearest = min(nearest, seen_depth(corner + ivec2(x, y), hair.a));
      }
    }
    if (spread > 0.0) {
      share(corner, last, total, nearest);
    }
  }
  total /= float(samples_per_side * samples_per_side);
  if (is_first != 0) {
    imageStore(sums, pixel, total);
    imageStore(nearest_depths, pixel, vec4(max(nearest, 0.0)));
  }
  else if (total.a > 0.0) {
    imageStore(sums, pixel, imageLoad(sums, pixel) + total);
    imageStore(nearest_depths, pixel, vec4(min(imageLoad(nearest_depths, pixel).r, max(nearest, 0.0))));
  }
}
