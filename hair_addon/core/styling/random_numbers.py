# SPDX-License-Identifier: GPL-3.0-or-later
"""Random numbers of strands and clumps, from an ID, the style's seed and a purpose, as in style_numbers.strand.

They depend only on roots, not on the order or number of strands, nor on a style's place in the stack. The mixing
function is lowbias32 [Wellons18].
"""

import numpy as np

# Purposes: numbers of a strand.
VARY, STRAY, LENGTH, UNDERCOAT, CROSSOVER, PHASE, TURN = range(7)
# Numbers of a clump.
CLUMP_PHASE, CLUMP_HAND, CLUMP_SHIFT, CLUMP_PITCH = 16, 17, 18, 19
# Numbers of each wave of a noise, and of the cells along a strand.
WAVE_PHASES, WAVE_VECTORS, CLUMP_CELLS = 32, 64, 128

PURPOSES = {name: value for name, value in globals().items() if name.isupper() and isinstance(value, int)}


def random_numbers(identities: np.ndarray, seed: int, purpose: int) -> np.ndarray:
    """Return (N,) float32 in [0, 1) of strands with IDs (N,) int32."""
    with np.errstate(over="ignore"):
        x = identities.astype(np.int32).view(np.uint32)
        x = (x ^ (np.uint32(seed) * np.uint32(0x9E3779B9))) + np.uint32(purpose) * np.uint32(0x85EBCA6B)
        x = (x ^ (x >> np.uint32(16))) * np.uint32(0x7FEB352D)
        x = (x ^ (x >> np.uint32(15))) * np.uint32(0x846CA68B)
        x ^= x >> np.uint32(16)
    return (x >> np.uint32(8)).astype(np.float32) * np.float32(2.0**-24)
