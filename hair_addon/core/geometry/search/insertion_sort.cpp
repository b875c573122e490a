// SPDX-License-Identifier: GPL-3.0-or-later
//
// In-place insertion sort of a few keys.
//
// The body of `_sort_bucket` in counting_sort.py. Parameters:
//
//   array_t<uint64> keys        of all buckets
//   int first, end              range of keys to sort

auto* key = keys.data;
for (int i = first + 1; i < end; ++i) {
  const auto moved = key[i];
  int place = i;
  for (; place > first && key[place - 1] > moved; --place) key[place] = key[place - 1];
  key[place] = moved;
}
