# SPDX-License-Identifier: GPL-3.0-or-later
"""Running sums of counts, on the device of the counts: where the items of each begin among all."""

import warp as wp


def ends_of(counts: wp.array) -> tuple[wp.array, int]:
    """Return the running sums of (N,) integers, where the items of each end among all, and their total."""
    ends = wp.empty_like(counts)
    wp.utils.array_scan(counts, ends, inclusive=True)
    return ends, int(ends[-1:].numpy()[0]) if len(counts) else 0
