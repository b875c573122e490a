// SPDX-License-Identifier: GPL-3.0-or-later
// Means around a texel of the depth of surfaces, warped, of the square of that [Donnelly06], and of the depth itself, along
// one axis: the wider, the softer the shadow.

#include "include/opacity.glsl"

void main()
{
  ivec2 here = ivec2(gl_FragCoord.xy);
  ivec2 last = textureSize(surface_depth, 0) - 1;
  vec3 total = vec3(0.0);
  float weights = 0.0;
  for (int tap = -taps; tap <= taps; tap++) {
    vec3 values = texelFetch(surface_depth, clamp(here + tap * along, ivec2(0), last), 0).rgb;
    if (is_depth != 0) {
      float warped = warped_depth(values.r);
      values = vec3(warped, warped * warped, values.r);
    }
    float weight = exp(-0.5 * float(tap * tap) / (deviation * deviation));
    total += weight * values;
    weights += weight;
  }
  color = vec4(total / weights, 1.0);
}
