// SPDX-License-Identifier: GPL-3.0-or-later
//
// Clump (clump.py): strands gather in locks.

const float thickness = number[8], twist = number[9], stray = number[10];
lanes joined = 1.0f;
if (stray > 0.0f) joined = clamped((random(STRAY) - 1.1f * stray) * 10.0f + 1.0f, lanes(0.0f), lanes(1.0f));
gather(thickness, twist, joined);
