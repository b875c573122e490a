// SPDX-License-Identifier: GPL-3.0-or-later

const float PI = 3.14159265358979;
