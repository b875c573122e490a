# SPDX-License-Identifier: GPL-3.0-or-later
"""Depth of field of a thin lens: the mean of pictures from points of its aperture, with a common focal plane.

[Haeberli90]
"""

import math
from dataclasses import dataclass

import numpy as np

_HALF = np.array([0.5, 0.5])


@dataclass(frozen=True)
class Lens:
    """Aperture and focus of a camera, with Cycles' interpretation of Blender's settings."""

    radius: float  # of the aperture [m]
    focus_distance: float  # along the view axis [m]
    blade_count: int = 0  # the aperture is a disk below 3
    rotation: float = 0.0  # of the blades [rad]
    ratio: float = 1.0  # height / width of the aperture

    def point(self, turn: int) -> np.ndarray:
        """Return the aperture point (2,) [m] of a pass; the first pass uses the center.

        Points follow the Halton sequence, which is uncorrelated with the pixel offsets of passes.
        """
        unit = _disk_point((np.array([_radical_inverse(turn, 2), _radical_inverse(turn, 3)]) + _HALF) % 1.0)
        if self.blade_count >= 3:
            unit = _polygon_point(unit, self.blade_count, self.rotation)
        return self.radius * unit / np.array([self.ratio, 1.0])

    def world_to_view(self, world_to_view: np.ndarray, turn: int) -> np.ndarray:
        """Return the view matrix (4, 4) of a pass: the central matrix, sheared so that the plane of focus is fixed."""
        x, y = self.point(turn)
        shear = np.eye(4)
        # Rays through (x, y, 0) and through the center intersect in the plane of focus.
        shear[:2, 2] = -x / self.focus_distance, -y / self.focus_distance
        shear[:2, 3] = -x, -y
        return shear @ world_to_view


def _radical_inverse(index: int, base: int) -> float:
    """Return the radical inverse of an index: its digits mirrored at the radix point."""
    value, place = 0.0, 1.0 / base
    while index:
        index, digit = divmod(index, base)
        value += digit * place
        place /= base
    return value


def _disk_point(square):
    """Return the point (2,) of the unit disk for a point of the unit square, preserving area ratios [Shirley97]."""
    a, b = 2.0 * square - 1.0
    if a == 0.0 and b == 0.0:
        return np.zeros(2)
    if abs(a) > abs(b):
        radius, angle = a, 0.25 * math.pi * b / a
    else:
        radius, angle = b, 0.5 * math.pi - 0.25 * math.pi * a / b
    return radius * np.array([math.cos(angle), math.sin(angle)])


def _polygon_point(disk, corner_count, rotation):
    """Return the point (2,) of a rotated [rad] regular polygon for a point of the unit disk, preserving area ratios.

    The polygon is inscribed in the disk.
    """
    sector = (math.atan2(disk[1], disk[0]) / (2.0 * math.pi) % 1.0) * corner_count
    first = math.floor(sector)
    angles = rotation + (np.array([first, first + 1]) - 0.5) * 2.0 * math.pi / corner_count
    corners = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    along = sector - first
    return float(np.hypot(*disk)) * ((1.0 - along) * corners[0] + along * corners[1])
