# SPDX-License-Identifier: GPL-3.0-or-later
"""Running sums of counts, on their device: offsets of each count's items in an array of all items."""

import warp as wp


def ends_of(counts: wp.array) -> tuple[wp.array, int]:
    """Return the running sums of (N,) counts, the ends of their items in an array of all items, and the total."""
    ends = wp.empty_like(counts)
    wp.utils.array_scan(counts, ends, inclusive=True)
    return ends, int(ends[-1:].numpy()[0]) if len(counts) else 0
