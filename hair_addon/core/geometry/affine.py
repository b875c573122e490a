# SPDX-License-Identifier: GPL-3.0-or-later
"""Affine transforms between coordinates that strands are stored in."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

_ROUNDING = 1e-6  # of single precision, in which Blender multiplies matrices


@dataclass(frozen=True, eq=False)
class Affine:
    """What takes points from one space to another: matrix (4, 4) float64. Its product with another does that first.

    Widths and lengths in a space are multiplied by `scale`, as renderers do: unevenly scaled strands are round, and as
    thick as the mean of the three axes makes them.
    """

    matrix: np.ndarray

    @classmethod
    def of(cls, values: object) -> "Affine":
        """The transform of 16 numbers, row after row, or of a matrix of Blender."""
        return cls(np.array(values, np.float64).reshape(4, 4))

    @classmethod
    def identity(cls) -> "Affine":
        """The transform that changes nothing."""
        return cls(np.eye(4))

    @classmethod
    def linear(cls, axes: np.ndarray) -> "Affine":
        """The transform of (3, 3) axes that leaves the origin where it is."""
        matrix = np.eye(4)
        matrix[:3, :3] = axes
        return cls(matrix)

    @classmethod
    def shift(cls, offset: np.ndarray) -> "Affine":
        """The transform that adds (3,) to all points."""
        matrix = np.eye(4)
        matrix[:3, 3] = offset
        return cls(matrix)

    def __matmul__(self, first: "Affine") -> "Affine":
        return Affine(self.matrix @ first.matrix)

    @cached_property
    def inverse(self) -> "Affine":
        """The way back. Raises `LinAlgError` where there is none."""
        return Affine(np.linalg.inv(self.matrix))

    @property
    def axes(self) -> np.ndarray:
        """(3, 3): of directions, without the translation."""
        return self.matrix[:3, :3]

    @property
    def scale(self) -> float:
        """The mean factor of lengths, at least zero."""
        return float(abs(np.linalg.det(self.axes))) ** (1.0 / 3.0)

    def as_blender(self) -> list[list[float]]:
        """Rows, of which Blender's `Matrix` is made."""
        return self.matrix.tolist()

    @property
    def is_mirroring(self) -> bool:
        """Whether it turns left into right."""
        return bool(np.linalg.det(self.axes) < 0.0)

    @property
    def is_valid(self) -> bool:
        """Whether it is finite and has an inverse."""
        return bool(np.isfinite(self.matrix).all()) and abs(np.linalg.det(self.axes)) >= 1e-30

    @property
    def keeps_axes(self) -> bool:
        """Whether it only shifts, and scales all axes by one factor, of either sign, beyond rounding."""
        size = np.trace(self.axes) / 3.0
        return np.allclose(self.axes, size * np.eye(3), rtol=0.0, atol=_ROUNDING * abs(size))

    @property
    def is_identity(self) -> bool:
        """Whether it changes nothing beyond rounding."""
        return np.allclose(self.matrix, np.eye(4), rtol=0.0, atol=_ROUNDING)

    @property
    def is_as_wide(self) -> bool:
        """Whether it leaves widths as they are, beyond rounding."""
        return abs(self.scale - 1.0) <= _ROUNDING

    def points(self, points: np.ndarray) -> np.ndarray:
        """(..., 3) points as float32; as they are, to the last bit, where nothing changes."""
        if self.is_identity:
            return np.asarray(points, np.float32)
        with np.errstate(invalid="ignore", over="ignore"):
            return (np.asarray(points, np.float64) @ self.axes.T + self.matrix[:3, 3]).astype(np.float32)

    def widths(self, widths: np.ndarray) -> np.ndarray:
        """Widths, radii or lengths as float32; as they are where they do not change."""
        if self.is_as_wide:
            return np.asarray(widths, np.float32)
        with np.errstate(invalid="ignore", over="ignore"):
            return (np.asarray(widths, np.float64) * self.scale).astype(np.float32)
