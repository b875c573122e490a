# SPDX-License-Identifier: GPL-3.0-or-later
"""Sizes of data textures that are not powers of two.

Software drivers compile a program separately for textures with sides that are powers of two, and for other textures.
"""

from collections.abc import Sequence

import numpy as np


def avoid_powers_of_two(lengths: Sequence[int] | np.ndarray | int) -> np.ndarray:
    """Return the smallest lengths, at least the given positive integers, that are not powers of two."""
    found = np.array(lengths)
    while (is_power := found & (found - 1) == 0).any():
        found += is_power
    return found
