// SPDX-License-Identifier: GPL-3.0-or-later
// The view of linked hair objects: one for all of them. shadows/view_of_map.glsl replaces this file.

View view_of_layer(int layer)
{
  return shared_view;
}
