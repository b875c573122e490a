# SPDX-License-Identifier: GPL-3.0-or-later
"""Sides of textures that hold data: none is a power of two.

Software drivers compile a program once for textures whose sides are powers of two, and again for others.
"""

import numpy as np


def beside_powers(lengths):
    """The least lengths, at least as great as these, of which none is a power of two."""
    lengths = np.array(lengths)
    while (is_power := lengths & (lengths - 1) == 0).any():
        lengths += is_power
    return lengths
