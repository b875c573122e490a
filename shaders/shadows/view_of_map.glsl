// SPDX-License-Identifier: GPL-3.0-or-later
// The view of hair objects in several shadow maps that are drawn together: replaces strands/shared_view.glsl.

View view_of_layer(int layer)
{
  return shadow_views.view[layer];
}
