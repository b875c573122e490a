# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks of counts and indices before kernel launches.

Kernels do not check indices: reading past the end of an array crashes Blender.
"""

import numpy as np
from numpy.typing import ArrayLike

from ..errors import HairError


def require_count(name: str, count: int, wanted: int) -> None:
    """Raise `HairError` unless a count of items has the expected value; name: the items' name."""
    if count != wanted:
        sentence = "Hair data does not match: {count} {name} instead of {wanted}. Regenerate the strands."
        raise HairError(sentence, name=name, count=count, wanted=wanted)


def require_indices(name: str, indices: ArrayLike, count: int) -> None:
    """Raise `HairError` unless all indices, of any shape, are in [0, count)."""
    indices = np.asarray(indices)
    if not indices.size:
        return
    lowest, highest = int(indices.min()), int(indices.max())
    if lowest < 0 or highest >= count:
        sentence = "Hair data does not match: index {index} is out of range for {count} {name}. Regenerate the strands."
        raise HairError(sentence, name=name, index=lowest if lowest < 0 else highest, count=count)
