# SPDX-License-Identifier: GPL-3.0-or-later
"""Fingerprints of points, to detect changes without keeping a copy."""

import numpy as np
import warp as wp

from ..kernels import parallel
from ..kernels.parallel import Rows

wp.set_module_options({"enable_backward": False})

BLOCK = 16  # words that one vector holds
PART = 256  # blocks that one thread adds up
block = wp.types.vector(length=BLOCK, dtype=wp.uint32)


@wp.kernel
def _sums(
    blocks: wp.array2d[block],
    # outputs
    out_sums: wp.array[block],
):
    part = wp.tid()
    total = block(wp.uint32(0))
    row = blocks[part]
    for place in range(row.shape[0]):
        words = row[place]
        # The upper half is added again, so that a sign bit, which an odd factor does not move, affects other bits.
        mixed = words + wp.uint32(31) * (words / wp.uint32(65536))
        total += wp.uint32(2 * place + 1) * mixed
    out_sums[part] = total


def fingerprint(points: np.ndarray) -> str:
    """16 hexadecimal digits of the bits of an array (..., 3) float32: those of another one differ, but for a freak.

    The sum of its words, each times an odd number that depends on its index: integers, so that it is the same on
    every machine, and nearly as fast as reading memory.
    """
    words = np.ascontiguousarray(points, np.float32).view(np.uint32).ravel()
    part_count = len(words) // (BLOCK * PART)
    whole = words[: part_count * BLOCK * PART].reshape(part_count, PART, BLOCK)
    sums = np.empty((part_count, BLOCK), np.uint32)
    if part_count:
        blocks, there = (wp.array(a, dtype=block, device="cpu", copy=False) for a in (whole, sums))
        parallel.launch(_sums, part_count, inputs=[Rows(blocks)], outputs=[there], device="cpu", least_rows=32)
    rest = np.concatenate([sums.ravel(), words[whole.size :]]).astype(np.uint64)
    odd = 2 * np.arange(len(rest), dtype=np.uint64) + np.uint64(1)
    return f"{int((odd * rest).sum(dtype=np.uint64)) ^ len(words):016x}"
