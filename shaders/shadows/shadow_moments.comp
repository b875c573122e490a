// SPDX-License-Identifier: GPL-3.0-or-later
// Blurs along one axis the warped depth of surfaces, its variance [Donnelly06], and the depth itself: a wider blur gives
// softer shadows. The slope of a surface does not count as variance, as it would let light through. The fourth component is
// the texel's packed color, without blur.

#include "shadows/opacity.glsl"

// Variance of a step in the middle, relative to its variance without slope.
const float STEP = 1.0 / (1.0 - 2.0 / PI);

ivec2 here;
ivec2 last;

vec3 values_at(int tap)
{
  vec3 values = texelFetch(surface_depth, ivec3(clamp(here + tap * along, ivec2(0), last), 0), 0).rgb;
  return (is_depth != 0) ? vec3(warped_depth(values.r), 0.0, values.r) : values;
}

// What the curvature of the warp adds to the mean of two texels on either side of a texel at this depth. It is removed for a
// plane, which would otherwise shade itself in grazing light. If the three are not collinear, a surface is in front of
// another.
float curve_of_warp(float depth, float before, float after)
{
  float mean = 0.5 * (before + after);
  float in_line = 1.0 - clamp(abs(mean - depth) / max(0.5 * abs(after - before), 1e-6), 0.0, 1.0);
  return in_line * (0.5 * (warped_depth(before) + warped_depth(after)) - warped_depth(mean));
}

void main()
{
  here = ivec2(gl_GlobalInvocationID.xy);
  last = textureSize(surface_depth, 0).xy - 1;
  if (any(greaterThan(here, last))) {
    return;
  }
  vec3 middle = values_at(0);
  vec3 total = vec3(0.0, middle.yz);
  float squares = 0.0;  // of differences from the middle, to keep precision
  float slope = 0.0;
  float curve = 0.0;
  float weights = 1.0;
  float reach = 0.0;
  // Incremental Gaussian: the ratio of consecutive weights decreases by a constant factor.
  float weight = 1.0;
  float ratio = exp(-0.5 / (deviation * deviation));
  float factor = ratio * ratio;
  for (int tap = 1; tap <= taps; tap++) {
    weight *= ratio;
    ratio *= factor;
    vec3 before = values_at(-tap);
    vec3 after = values_at(tap);
    before.x -= middle.x;
    after.x -= middle.x;
    total += weight * (before + after);
    curve += 2.0 * weight * curve_of_warp(middle.z, before.z, after.z);
    squares += weight * (before.x * before.x + after.x * after.x);
    slope += weight * float(tap) * (after.x - before.x);
    weights += 2.0 * weight;
    reach += 2.0 * weight * float(tap * tap);
  }
  vec3 mean = total / weights;
  float variance = max(squares / weights - mean.x * mean.x, 0.0);
  float beside_slope = max(variance - slope * slope / (reach * weights), 0.0);
  vec4 own = texelFetch(surface_depth, ivec3(here, 0), 0);
  float own_color = (is_depth != 0) ? own.g : own.a;
  vec4 found = vec4(mean.x + middle.x - curve / weights, mean.y + min(variance, STEP * beside_slope), mean.z, own_color);
  imageStore(filtered, ivec3(here, layer), found);
}
