# SPDX-License-Identifier: GPL-3.0-or-later
"""Arrays that another program owns, by their address."""

import numpy as np
import warp as wp


def write(address: int, values: np.ndarray) -> None:
    """Write float32 values to the processor's memory from an address on, where as many must have their place."""
    values = np.ascontiguousarray(values, np.float32).ravel()
    if len(values):
        wp.array(ptr=address, dtype=wp.float32, shape=values.shape, device="cpu").assign(values)
