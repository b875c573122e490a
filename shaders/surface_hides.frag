// SPDX-License-Identifier: GPL-3.0-or-later
// A surface drawn by Blender: here it only occludes the hair behind it.

void main()
{
  color = vec4(0.0);
}
