# SPDX-License-Identifier: GPL-3.0-or-later
"""The bounding box of strands, which the GPU may still be making."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np


@dataclass
class StrandBox:
    """A bounding box; boxes are (2, 3): least and greatest coordinates.

    read: returns the box, and waits until the GPU has made the strands; known: the box, None: not read yet; former: the
    box of the strands before they changed, which may stand for the box until it is read, None: it may not.
    """

    read: Callable[[], np.ndarray]
    known: np.ndarray | None = None
    former: np.ndarray | None = None

    @property
    def exact(self) -> np.ndarray:
        """The box; the first use may wait for the GPU."""
        if self.known is None:
            self.known = self.read()
        return self.known

    @property
    def is_exact(self) -> bool:
        """Whether `likely` and `loose` are the exact box."""
        return self.known is not None or self.former is None

    @property
    def is_pending(self) -> bool:
        """Whether `likely` may wait for the GPU."""
        return self.known is None and self.former is None

    @property
    def likely(self) -> np.ndarray:
        """The exact box if it is known, otherwise `former` if there is one."""
        return self.exact if self.is_exact else self.former

    @property
    def loose(self) -> np.ndarray:
        """`likely`, twice as large unless it is exact: strands outside of it are not drawn."""
        likely = self.likely
        return likely if self.is_exact else likely + 0.5 * (likely - likely[::-1])

    def require(self) -> None:
        """Let no other box stand for the exact box."""
        self.former = None


def known_box(bounds: np.ndarray) -> StrandBox:
    """Return the `StrandBox` of a known box (2, 3)."""
    return StrandBox(lambda: bounds, bounds)
