// SPDX-License-Identifier: GPL-3.0-or-later
// Subset of strands for the level of detail.

// The strand of an index in drawing order. Neighbours in memory are neighbours on the surface, so consecutive indices are
// spread over all strands: an index goes to the next part of the strands, and within it by strides of the golden ratio.
int drawn_strand(int turn)
{
  if (view.drawn_strands == view.strand_count) {
    return turn;
  }
  turn += view.first_strand;
  turn -= (turn < view.strand_count) ? 0 : view.strand_count;
  int parts = view.strand_count / view.part_size;
  int round = turn / parts;
  if (round >= view.part_size) {
    return turn;  // fewer than there are parts are left over, behind the last one
  }
  return (turn - round * parts) * view.part_size + (round * view.part_stride) % view.part_size;
}
