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

// Adds the samples of a pixel, with a weight, to their total; `nearest` becomes their least depth.
void add_pixel(ivec2 corner, float part, inout vec4 total, inout float nearest)
{
  for (int y = 0; y < samples_per_side; y++) {
    for (int x = 0; x < samples_per_side; x++) {
      vec4 hair = texelFetch(picture, corner + ivec2(x, y), 0);
      total += part * hair;
      if (hair.a > 0.0) {
        nearest = min(nearest, depth_of(corner + ivec2(x, y), hair.a));
      }
    }
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
    float own = 1.0 - 2.0 * spread;
    add_pixel(corner, own * own, total, nearest);
    if (spread > 0.0) {
      float beside = 1.0;
      for (int turn = 0; turn < 9; turn++) {
        ivec2 offset = ivec2(turn % 3 - 1, turn / 3 - 1);
        if (offset != ivec2(0)) {
          float part = ((offset.x == 0) ? own : spread) * ((offset.y == 0) ? own : spread);
          add_pixel(clamp(corner + offset * samples_per_side, ivec2(0), last), part, total, beside);
        }
      }
      nearest = (nearest < 1.0) ? nearest : beside;
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
