# SPDX-License-Identifier: GPL-3.0-or-later
"""Sides of textures that hold data: none is a power of two.

Software drivers compile a program once for textures whose sides are powers of two, and again for others.
"""

from collections.abc import Sequence

import numpy as np


def beside_powers(lengths: Sequence[int] | np.ndarray | int) -> np.ndarray:
    """The least lengths, at least as great as these whole numbers above zero, of which none is a power of two."""
    found = np.array(lengths)
    while (is_power := found & (found - 1) == 0).any():
        found += is_power
    return found
