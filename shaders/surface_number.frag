// SPDX-License-Identifier: GPL-3.0-or-later
// The nearest triangle of each sample: in the visibility buffer, numbers of triangles are beyond those of segments.

#include "include/no_segment.glsl"

void main()
{
  segment = NO_SEGMENT + 1u + uint(triangle);
}
