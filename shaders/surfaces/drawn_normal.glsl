// SPDX-License-Identifier: GPL-3.0-or-later

// The normal of a surface drawn as triangles, on the viewer's side.
vec3 drawn_normal()
{
  return normalize((gl_FrontFacing != (view.is_mirrored != 0)) ? surface_normal : -surface_normal);
}
