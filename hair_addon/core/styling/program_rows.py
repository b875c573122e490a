# SPDX-License-Identifier: GPL-3.0-or-later
"""A program of styles as rows of numbers, a row for each step, as the kernel of steps.py reads them."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

# The whole numbers of a step: its kind, of `kinds.STEP_KINDS`; its seed; its row of masks or -1; its row of members or
# -1; the first of the centres that members count from.
CHOICES = ("kind", "seed", "mask", "level", "first_centre")
# The numbers that all steps have, and how many they have with their own, which follow.
SHARED = ("amount", "vary", "at_root", "at_tip", "exponent", "is_flipped", "from", "keep_length")
NUMBERS = 24


@dataclass(frozen=True)
class Program:
    """Steps as a kernel reads them: (N, 5) int32 `CHOICES` and (N, NUMBERS) float32, which are not changed any more."""

    choices: np.ndarray
    numbers: np.ndarray
    copies: dict[str, list[Any]] = field(init=False, default_factory=dict, compare=False)  # Warp arrays by device

    def __len__(self) -> int:
        return len(self.choices)

    def before(self, step: int) -> "Program":
        """The steps before one of them."""
        return Program(self.choices[:step], self.numbers[:step])
