// SPDX-License-Identifier: GPL-3.0-or-later
// Which part of a strand's light is drawn: all of it, unless a program has constants of these names in place of this file.

const vec4 drawn_lobes = vec4(1.0);  // R, TT, TRT and all else that comes from lights
const float drawn_world = 1.0;
