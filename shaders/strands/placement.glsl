// SPDX-License-Identifier: GPL-3.0-or-later
// The hair object of a thread: a single object, whose record is the block `view`. strands/batch_placement.glsl replaces this
// file in programs that draw linked objects together.

// Whether a segment belongs to the hair; found: its index in the object.
bool find_segment(uint segment, out int found)
{
  uint index = segment - uint(view.first_segment);
  found = int(index);
  return index < uint(view.strand_count * (view.drawn_points - 1));
}
