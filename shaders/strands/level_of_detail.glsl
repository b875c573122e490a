// SPDX-License-Identifier: GPL-3.0-or-later
// Subset of strands for the level of detail.

// The strand of an index in drawing order. Neighbors in memory are neighbors on the surface, so consecutive indices are
// spread over all strands: each index goes to the next part of the strands, and within a part by strides of the golden
// ratio.
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
    return turn;  // strands left over behind the last part, fewer than there are parts
  }
  return (turn - round * parts) * view.part_size + (round * view.part_stride) % view.part_size;
}

// Factor of the length by which the ends of a strand extend it in a picture: a strand that represents others is thicker,
// but no longer, than each of them. 1 in shadow maps.
float end_share()
{
  return (view.sample_offset > 0.0) ? float(view.drawn_strands) / float(view.strand_count) : 1.0;
}
