// SPDX-License-Identifier: GPL-3.0-or-later
// Depth without light: the colour is drawn over by the pass that follows.

void main()
{
  color = vec4(0.0);
}
