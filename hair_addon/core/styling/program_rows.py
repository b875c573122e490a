# SPDX-License-Identifier: GPL-3.0-or-later
"""A program of styles as rows of numbers, a row for each step, as the kernel of steps.py reads them."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

TRIM, CLUMP, CURL, FRIZZ, BEND, SMOOTH, WEAVE = range(1, 8)  # the kinds of steps

CHOICES = 5  # kind, seed, row of masks or -1, row of members or -1, first of the centres that members count from
NUMBERS = 24  # amount, vary; root, tip, exponent, whether flipped and start of the profile; keep_length; 16 of the step


@dataclass(frozen=True)
class Program:
    """Steps as a kernel reads them: (N, CHOICES) int32 and (N, NUMBERS) float32, which are not changed any more."""

    choices: np.ndarray
    numbers: np.ndarray
    copies: dict[str, list[Any]] = field(init=False, default_factory=dict, compare=False)  # Warp arrays by device

    def __len__(self) -> int:
        return len(self.choices)

    def before(self, step: int) -> "Program":
        """The steps before one of them."""
        return Program(self.choices[:step], self.numbers[:step])
