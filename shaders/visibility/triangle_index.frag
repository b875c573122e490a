// SPDX-License-Identifier: GPL-3.0-or-later
// The nearest triangle of each sample: in the visibility buffer, indices of triangles follow those of segments.

#include "visibility/sample_values.glsl"

void main()
{
  segment = NO_SEGMENT + 1u + uint(triangle);
}
