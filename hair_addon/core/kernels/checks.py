# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks of counts and indices before kernel launches.

Kernels do not check their indices. Reading past the end of an array crashes Blender.
"""

import numpy as np
from numpy.typing import ArrayLike

from ..errors import HairError


def require_count(name: str, count: int, wanted: int) -> None:
    """Raise `HairError` unless two counts that belong together are equal."""
    if count != wanted:
        sentence = "Hair data does not match: {count} {name} instead of {wanted}. Regenerate the strands."
        raise HairError(sentence, name=name, count=count, wanted=wanted)


def require_indices(name: str, indices: ArrayLike, count: int) -> None:
    """Raise `HairError` unless every index (any shape, NumPy) is at least 0 and below a count."""
    indices = np.asarray(indices)
    if not indices.size:
        return
    lowest, highest = int(indices.min()), int(indices.max())
    if lowest < 0 or highest >= count:
        sentence = "Hair data does not match: index {index} is out of range for {count} {name}. Regenerate the strands."
        raise HairError(sentence, name=name, index=lowest if lowest < 0 else highest, count=count)
