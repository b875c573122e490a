// SPDX-License-Identifier: GPL-3.0-or-later
// Rasterization without the covered parts of pixels: see visibility/covered_parts.glsl, which replaces this file.

void count_part(bool is_steep, int column, int last_row, vec2 rows, float along) {}

void count_all(ivec2 place) {}
