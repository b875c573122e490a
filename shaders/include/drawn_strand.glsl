// SPDX-License-Identifier: GPL-3.0-or-later
// Some strands in place of all.

// Which strand is drawn at a turn. Neighbours in memory are neighbours on the surface, so any turns in a row are spread
// over all of them: a turn goes to the next part of the strands, and around each part in strides of the golden ratio.
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
