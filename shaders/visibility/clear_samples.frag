// SPDX-License-Identifier: GPL-3.0-or-later
// No strand and no triangle in any sample, where a picture starts.

#include "visibility/sample_values.glsl"

void main()
{
  segment = NO_SEGMENT;
}
