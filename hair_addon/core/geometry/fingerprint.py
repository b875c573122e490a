# SPDX-License-Identifier: GPL-3.0-or-later
"""Fingerprints of points, to detect changes without keeping a copy; and comparisons with a copy."""

import numpy as np
import warp as wp

from ..kernels import parallel
from ..kernels.checks import require_count
from ..kernels.parallel import Rows

wp.set_module_options({"enable_backward": False})

BLOCK = 16  # words in a vector
PART = 256  # blocks of a thread
ROWS = 64  # about the number of rows that are compared first
block = wp.types.vector(length=BLOCK, dtype=wp.uint32)


@wp.func
def _mixed(words: block):
    # The upper half is mixed into the lower bits: odd factors alone would leave a sign bit in place.
    return words + wp.uint32(31) * (words / wp.uint32(65536))


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
        total += wp.uint32(2 * place + 1) * _mixed(row[place])
    out_sums[part] = total


@wp.kernel
def _sums_and_copies(
    blocks: wp.array2d[block],
    # outputs
    out_sums: wp.array[block],
    out_blocks: wp.array2d[block],
):
    part = wp.tid()
    total = block(wp.uint32(0))
    row = blocks[part]
    out_row = out_blocks[part]
    for place in range(row.shape[0]):
        words = row[place]
        out_row[place] = words
        total += wp.uint32(2 * place + 1) * _mixed(words)
    out_sums[part] = total


def fingerprint(points: np.ndarray, out: np.ndarray | None = None) -> str:
    """Return a hash of 16 hexadecimal digits of the bits of an array (..., 3) float32.

    The hash is the sum of the words, each times an odd number that depends on its index. Integer sums are equal on all
    machines and nearly as fast as reading memory.

    out: contiguous float32 of the same size, to which the points are copied in the same pass.
    """
    words = np.ascontiguousarray(points, np.float32).view(np.uint32).ravel()
    part_count = len(words) // (BLOCK * PART)
    whole_count = part_count * BLOCK * PART
    sums = np.empty((part_count, BLOCK), np.uint32)
    outputs, kernel = [_blocks(sums)], _sums
    if out is not None:
        require_count("numbers to copy to", out.size, len(words))
        copies = out.reshape(-1, copy=False).view(np.uint32)
        copies[whole_count:] = words[whole_count:]
        outputs, kernel = [*outputs, _blocks(copies[:whole_count].reshape(part_count, PART, BLOCK))], _sums_and_copies
    if part_count:
        inputs = [Rows(_blocks(words[:whole_count].reshape(part_count, PART, BLOCK)))]
        parallel.launch(kernel, part_count, inputs=inputs, outputs=outputs, device="cpu", least_rows=128)
    rest = np.concatenate([sums.ravel(), words[whole_count:]]).astype(np.uint64)
    odd = 2 * np.arange(len(rest), dtype=np.uint64) + np.uint64(1)
    return f"{int((odd * rest).sum(dtype=np.uint64)) ^ len(words):016x}"


def are_equal(values: np.ndarray, others: np.ndarray) -> bool:
    """`np.array_equal` of two arrays, which are the same object, or mostly differ in some of a few rows.

    A pose moves most vertices, so that few of them show that it is another pose.
    """
    if values is others:
        return True
    step = max(len(values) // ROWS, 1)
    return np.array_equal(values[::step], others[::step]) and np.array_equal(values, others)


def _blocks(words):
    """Return (..., BLOCK) uint32 as a Warp array of blocks."""
    return wp.array(words, dtype=block, device="cpu", copy=False)
