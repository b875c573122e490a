# SPDX-License-Identifier: GPL-3.0-or-later
"""Arrays in memory of another program, by address."""

import numpy as np
import warp as wp


def at(address: int, count: int) -> np.ndarray:
    """Return a view (count,) float32 of CPU memory at an address, which must be valid for `count` numbers.

    The view is valid until the other program moves or frees the memory.
    """
    if not count:
        return np.empty(0, np.float32)
    return wp.array(ptr=address, dtype=wp.float32, shape=(count,), device="cpu").numpy()
