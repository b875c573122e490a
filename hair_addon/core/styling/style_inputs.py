# SPDX-License-Identifier: GPL-3.0-or-later
"""Inputs of styles: masks, planes of cutters, directions of objects."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from .base import Cutter
from .courses import Courses
from .masks import CutMask, Mask
from .varied_numbers import NumberMap


@dataclass(frozen=True)
class Inputs:
    """Masks by `program.mask_key`; planes of cutters and directions of targets by the names of objects.

    numbers: values that differ between strands, by (index of the style, name of its setting);
    courses: curves from root to tip of numbers, by the same keys.
    """

    masks: Mapping[tuple[str, str, bool], Mask | CutMask] = field(default_factory=dict)
    cutters: Mapping[str, Cutter] = field(default_factory=dict)
    targets: Mapping[str, np.ndarray] = field(default_factory=dict)
    numbers: Mapping[tuple[int, str], NumberMap] = field(default_factory=dict)
    courses: Courses = field(default_factory=dict)
