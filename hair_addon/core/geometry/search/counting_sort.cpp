// SPDX-License-Identifier: GPL-3.0-or-later
//
// Stable counting sort of keys by their upper bits.
//
// The body of `_put_in_buckets` in counting_sort.py. Parameters, for N keys and B buckets:
//
//   array_t<uint64> keys        (N,) keys; key >> shift is below B
//   int shift                   number of lower bits to ignore
//   array_t<int> out_starts     (B + 1,) zeros; becomes the start of each bucket in `out_keys`, and the end
//   array_t<uint64> out_keys    (N,) sorted by bucket

const auto* key = keys.data;
auto* start = out_starts.data;
auto* to = out_keys.data;
const int key_count = keys.shape[0];
const int bucket_count = out_starts.shape[0] - 1;
for (int i = 0; i < key_count; ++i) ++start[key[i] >> shift];
int total = 0;
for (int bucket = 0; bucket < bucket_count; ++bucket) {
  const int count = start[bucket];
  start[bucket] = total;
  total += count;
}
for (int i = 0; i < key_count; ++i) to[start[key[i] >> shift]++] = key[i];
// Each start is now the end of its bucket.
for (int bucket = bucket_count; bucket > 0; --bucket) start[bucket] = start[bucket - 1];
start[0] = 0;
