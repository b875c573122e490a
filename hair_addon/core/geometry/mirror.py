# SPDX-License-Identifier: GPL-3.0-or-later
"""Mirrors: planes through the origin, and along what things are mirrored at them."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Mirror:
    """A plane through the origin [m], and along what things are mirrored at it.

    normal (3,), unit; across (3,): from the plane to height 1 above it, None for the normal. An object that is sheared
    in the world is mirrored along its own axis, which is not at right angles to the plane.
    """

    normal: np.ndarray
    across: np.ndarray | None = None

    def image(self, vectors: np.ndarray) -> np.ndarray:
        """(N, 3) positions or directions, mirrored."""
        return vectors - 2.0 * (vectors @ self.normal)[:, None] * self._across

    @property
    def matrix(self) -> np.ndarray:
        """(3, 3): that mirrors a position or a direction."""
        return np.eye(3) - 2.0 * np.outer(self._across, self.normal)

    def flipped(self) -> "Mirror":
        """The same, with its normal towards the other side."""
        return Mirror(-self.normal, None if self.across is None else -self.across)

    @property
    def _across(self):
        return self.normal if self.across is None else self.across


ACROSS_X = Mirror(np.array([1.0, 0.0, 0.0]))
