# SPDX-License-Identifier: GPL-3.0-or-later
"""Descent directions by a limited-memory quasi-Newton method, L-BFGS  [Liu89], algorithm 7.4 of [Nocedal06]."""

from collections.abc import Callable

import numpy as np


class Memory:
    """The last steps and the changes of the gradient along them."""

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._pairs: list[tuple[np.ndarray, np.ndarray, float]] = []

    def __len__(self) -> int:
        return len(self._pairs)

    def clear(self) -> None:
        """Discard all steps: the next direction is the preconditioned steepest descent."""
        self._pairs.clear()

    def add(self, step: np.ndarray, change: np.ndarray) -> None:
        """Add a step (n, 3) and the change of the gradient (n, 3); steps without positive curvature are ignored."""
        curvature = dot(step, change)
        if self._limit and curvature > 1e-10 * (dot(step, step) * dot(change, change)) ** 0.5:
            self._pairs = [*self._pairs, (step, change, curvature)][-self._limit :]

    def direction(self, gradient: np.ndarray, solved: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """Return the descent direction for a gradient (n, 3); solved: applies the approximate inverse Hessian."""
        direction, parts = gradient, []
        for step, change, curvature in reversed(self._pairs):
            parts.append(dot(step, direction) / curvature)
            direction = direction - parts[-1] * change
        direction = solved(direction)
        for (step, change, curvature), part in zip(self._pairs, reversed(parts), strict=True):
            direction = direction + (part - dot(change, direction) / curvature) * step
        return -direction


def dot(first: np.ndarray, second: np.ndarray) -> float:
    """Return the sum of products in a fixed order, independent of a library's threads."""
    return float((first * second).sum())
