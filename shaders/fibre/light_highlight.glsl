// SPDX-License-Identifier: GPL-3.0-or-later
// Factor of R for the light that is being added: lights of Solid shading have a color of their own for highlights.

float light_highlight;
