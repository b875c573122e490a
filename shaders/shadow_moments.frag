// SPDX-License-Identifier: GPL-3.0-or-later
// Means around a texel of the depth of surfaces, warped, of the square of that [Donnelly06], and of the depth itself, along
// one axis: the wider, the softer the shadow.

#include "include/opacity.glsl"

ivec2 here;
ivec2 last;

vec3 values_at(int tap)
{
  vec3 values = texelFetch(surface_depth, clamp(here + tap * along, ivec2(0), last), 0).rgb;
  if (is_depth != 0) {
    float warped = warped_depth(values.r);
    values = vec3(warped, warped * warped, values.r);
  }
  return values;
}

void main()
{
  here = ivec2(gl_FragCoord.xy);
  last = textureSize(surface_depth, 0) - 1;
  vec3 total = values_at(0);
  float weights = 1.0;
  // A Gaussian from tap to tap: the ratio of one weight to the one before falls by the same factor each time.
  float weight = 1.0;
  float ratio = exp(-0.5 / (deviation * deviation));
  float factor = ratio * ratio;
  for (int tap = 1; tap <= taps; tap++) {
    weight *= ratio;
    ratio *= factor;
    total += weight * (values_at(-tap) + values_at(tap));
    weights += 2.0 * weight;
  }
  color = vec4(total / weights, 1.0);
}
