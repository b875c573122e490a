// SPDX-License-Identifier: GPL-3.0-or-later

const int TILE = 8;  // samples along each side of the tiles for occlusion culling
