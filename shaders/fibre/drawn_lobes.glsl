// SPDX-License-Identifier: GPL-3.0-or-later
// The drawn components of a strand's light: all, unless a program defines constants of these names instead.

const vec4 drawn_lobes = vec4(1.0);  // R, TT, TRT and all other light from lights
const float drawn_world = 1.0;
