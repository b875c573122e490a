# SPDX-License-Identifier: GPL-3.0-or-later
"""Affine transforms between coordinate spaces of strands."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

_ROUNDING = 1e-6  # tolerance for single precision, in which Blender multiplies matrices


@dataclass(frozen=True, eq=False)
class Affine:
    """An affine transform between spaces: matrix (4, 4) float64. `a @ b` applies b first.

    Widths and lengths are multiplied by `scale`, as in renderers: unevenly scaled strands stay round, with the
    geometric mean of the three axes' scales.
    """

    matrix: np.ndarray

    @classmethod
    def of(cls, values: object) -> "Affine":
        """Return the transform of 16 numbers in row-major order, or of Blender's `Matrix`."""
        return cls(np.array(values, np.float64).reshape(4, 4))

    @classmethod
    def identity(cls) -> "Affine":
        """Return the identity transform."""
        return cls(np.eye(4))

    @classmethod
    def linear(cls, axes: np.ndarray) -> "Affine":
        """Return the linear transform of a matrix (3, 3)."""
        matrix = np.eye(4)
        matrix[:3, :3] = axes
        return cls(matrix)

    @classmethod
    def shift(cls, offset: np.ndarray) -> "Affine":
        """Return the translation by an offset (3,)."""
        matrix = np.eye(4)
        matrix[:3, 3] = offset
        return cls(matrix)

    def __matmul__(self, first: "Affine") -> "Affine":
        return Affine(self.matrix @ first.matrix)

    @cached_property
    def inverse(self) -> "Affine":
        """The inverse transform. Raises `LinAlgError` for a singular matrix."""
        return Affine(np.linalg.inv(self.matrix))

    @property
    def axes(self) -> np.ndarray:
        """The linear part (3, 3), for directions."""
        return self.matrix[:3, :3]

    @property
    def scale(self) -> float:
        """The geometric mean of the axes' scales, at least zero."""
        return float(abs(np.linalg.det(self.axes))) ** (1.0 / 3.0)

    def as_blender(self) -> list[list[float]]:
        """Return the rows for Blender's `Matrix`."""
        return self.matrix.tolist()

    @property
    def is_mirroring(self) -> bool:
        """Whether the determinant is negative."""
        return bool(np.linalg.det(self.axes) < 0.0)

    @property
    def is_valid(self) -> bool:
        """Whether the matrix is finite and invertible."""
        return bool(np.isfinite(self.matrix).all()) and abs(np.linalg.det(self.axes)) >= 1e-30

    @property
    def is_uniform_scale(self) -> bool:
        """Whether the linear part is a uniform scale, of either sign, within rounding."""
        size = np.trace(self.axes) / 3.0
        return np.allclose(self.axes, size * np.eye(3), rtol=0.0, atol=_ROUNDING * abs(size))

    @property
    def is_identity(self) -> bool:
        """Whether the matrix is the identity within rounding."""
        return np.allclose(self.matrix, np.eye(4), rtol=0.0, atol=_ROUNDING)

    @property
    def preserves_widths(self) -> bool:
        """Whether widths are unchanged within rounding."""
        return abs(self.scale - 1.0) <= _ROUNDING

    def points(self, points: np.ndarray) -> np.ndarray:
        """Return transformed points (..., 3) float32; bit-identical for the identity."""
        if self.is_identity:
            return np.asarray(points, np.float32)
        with np.errstate(invalid="ignore", over="ignore"):
            return (np.asarray(points, np.float64) @ self.axes.T + self.matrix[:3, 3]).astype(np.float32)

    def widths(self, widths: np.ndarray) -> np.ndarray:
        """Return scaled widths, radii or lengths, float32; bit-identical if `preserves_widths`."""
        if self.preserves_widths:
            return np.asarray(widths, np.float32)
        with np.errstate(invalid="ignore", over="ignore"):
            return (np.asarray(widths, np.float64) * self.scale).astype(np.float32)
