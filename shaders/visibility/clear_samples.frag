// SPDX-License-Identifier: GPL-3.0-or-later
// Clears all samples at the start of a picture: no strand and no triangle.

#include "visibility/sample_values.glsl"

void main()
{
  segment = NO_SEGMENT;
}
