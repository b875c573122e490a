// SPDX-License-Identifier: GPL-3.0-or-later
// Factor of R for the light that is being added: lights of Solid shading have a color of their own for highlights.

vec3 light_highlight = vec3(1.0);
