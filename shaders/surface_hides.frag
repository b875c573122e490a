// SPDX-License-Identifier: GPL-3.0-or-later
// A surface that Blender draws: here it only hides the hair behind it.

void main()
{
  color = vec4(0.0);
}
