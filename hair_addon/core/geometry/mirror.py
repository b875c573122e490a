# SPDX-License-Identifier: GPL-3.0-or-later
"""Reflections in planes through the origin."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Mirror:
    """A reflection in a plane through the origin, along a given direction.

    normal (3,), unit; across (3,): direction of the reflection with across · normal = 1, None for the normal. An object
    that is sheared in world space is reflected along the object's axis, which is oblique to the plane.
    """

    normal: np.ndarray
    across: np.ndarray | None = None

    def image(self, vectors: np.ndarray) -> np.ndarray:
        """Return reflected positions or directions (N, 3)."""
        return vectors - 2.0 * (vectors @ self.normal)[:, None] * self._across

    @property
    def matrix(self) -> np.ndarray:
        """The matrix (3, 3) of the reflection."""
        return np.eye(3) - 2.0 * np.outer(self._across, self.normal)

    def flipped(self) -> "Mirror":
        """Return the same reflection with the opposite normal."""
        return Mirror(-self.normal, None if self.across is None else -self.across)

    @property
    def _across(self):
        return self.normal if self.across is None else self.across


ACROSS_X = Mirror(np.array([1.0, 0.0, 0.0]))
