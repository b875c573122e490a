// SPDX-License-Identifier: GPL-3.0-or-later
// Means around a texel, along one axis, of the depth of surfaces, warped, its variance [Donnelly06], and the mean of the
// depth itself: the wider, the softer the shadow. The slope of a surface is no variance: it would let light through.

#include "include/opacity.glsl"

// Of the variance that a step in the middle leaves beside its slope, the whole.
const float STEP = 1.0 / (1.0 - 2.0 / PI);

void main()
{
  ivec2 here = ivec2(gl_FragCoord.xy);
  ivec2 last = textureSize(surface_depth, 0) - 1;
  vec3 total = vec3(0.0);
  float squares = 0.0;
  float slope = 0.0;
  float weights = 0.0;
  float reach = 0.0;
  float first = 0.0;  // differences to it keep their digits
  for (int tap = -taps; tap <= taps; tap++) {
    vec3 values = texelFetch(surface_depth, clamp(here + tap * along, ivec2(0), last), 0).rgb;
    if (is_depth != 0) {
      values = vec3(warped_depth(values.r), 0.0, values.r);
    }
    first = (tap == -taps) ? values.x : first;
    values.x -= first;
    float weight = exp(-0.5 * float(tap * tap) / (deviation * deviation));
    total += weight * values;
    squares += weight * values.x * values.x;
    slope += weight * float(tap) * values.x;
    weights += weight;
    reach += weight * float(tap * tap);
  }
  vec3 mean = total / weights;
  float variance = max(squares / weights - mean.x * mean.x, 0.0);
  float beside_slope = max(variance - slope * slope / (reach * weights), 0.0);
  color = vec4(mean.x + first, mean.y + min(variance, STEP * beside_slope), mean.z, 1.0);
}
