# SPDX-License-Identifier: GPL-3.0-or-later
"""Arrays that another program owns, by their address."""

import numpy as np
import warp as wp


def at(address: int, count: int) -> np.ndarray:
    """(count,) float32 in the processor's memory from an address on, where as many must have their place.

    It is valid as long as the other program leaves that memory where it is.
    """
    if not count:
        return np.empty(0, np.float32)
    return wp.array(ptr=address, dtype=wp.float32, shape=(count,), device="cpu").numpy()
