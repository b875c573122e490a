// SPDX-License-Identifier: GPL-3.0-or-later
// Index of a work group among those of its hair object, for programs that rasterize runs of segments. A program for linked
// objects includes strands/batch_run_group.glsl in place of this file.

int group_in_object(int group)
{
  return group;
}
