# SPDX-License-Identifier: GPL-3.0-or-later
"""How much hair lies to each side of a place: what the light of the surroundings has to cross.

Strands are poured into a grid of cubic cells as the shadow that they cast, which for directions from everywhere is
pi / 4 of length × diameter, by the area of a cell's face. Sums along the axes count the strands on the way out.
"""

from dataclasses import dataclass

import numpy as np

SOLID = 50.0  # strands that a cell of a surface counts for: nothing comes through
SIDES = ("+x", "-x", "+y", "-y", "+z", "-z")


@dataclass(frozen=True, eq=False)
class HairVolume:
    """counts (D, H, W, 6) float32: mean number of strands from a cell's centre to the outside, in the order of `SIDES`.

    low, high (3,) [m]: the box; its cells are indexed z, y, x, as a texture holds them.
    """

    counts: np.ndarray
    low: np.ndarray
    high: np.ndarray


def measure(starts, ends, widths, solid_points, resolution=48):
    """Segments of strands from starts to ends (N, 3), widths (N,), places on surfaces (M, 3), all [m] → `HairVolume`.

    resolution: cells along the box's longest side.
    """
    low = np.minimum(starts.min(axis=0), ends.min(axis=0)).astype(float)
    high = np.maximum(starts.max(axis=0), ends.max(axis=0)).astype(float)
    cell = max(float((high - low).max()), 1e-9) / resolution
    shape = np.maximum(np.ceil((high - low) / cell), 1.0).astype(int)  # x, y, z
    high = low + shape * cell

    shadows = 0.25 * np.pi * widths * np.linalg.norm(ends - starts, axis=-1)
    hair = np.bincount(_cells(0.5 * (starts + ends), low, cell, shape), shadows, np.prod(shape)) / cell**2
    inside = ((solid_points >= low) & (solid_points < high)).all(axis=1)
    solid = np.zeros(np.prod(shape))
    solid[_cells(solid_points[inside], low, cell, shape)] = SOLID
    hair, solid = hair.reshape(shape[::-1]), solid.reshape(shape[::-1])

    # Beyond the cell itself, and half of its own hair; a surface's own cell holds the roots, which it does not cover.
    sums = [_beyond(hair + solid, axis, towards) + 0.5 * hair for axis in (2, 1, 0) for towards in (1, -1)]
    return HairVolume(np.stack(sums, axis=-1).astype(np.float32), low, high)


def _cells(places, low, cell, shape):
    """Index of the cell of each place (N, 3), clamped to the box."""
    x, y, z = np.clip(((places - low) / cell).astype(int), 0, shape - 1).T
    return (z * shape[1] + y) * shape[0] + x


def _beyond(values, axis, towards):
    """Sum of the cells that lie on one side of each cell."""
    forward = np.cumsum(values, axis=axis)
    return forward - values if towards < 0 else forward.take([-1], axis=axis) - forward
