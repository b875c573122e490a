# SPDX-License-Identifier: GPL-3.0-or-later
"""Depth of field of a thin lens: a picture is the mean of those seen from the points of its aperture.

Each is in focus at the same plane, as in [Haeberli90].
"""

import math
from dataclasses import dataclass

import numpy as np

_HALF = np.array([0.5, 0.5])


@dataclass(frozen=True)
class Lens:
    """Aperture and focus of a camera, as Cycles understands Blender's settings."""

    radius: float  # of the aperture [m]
    focus_distance: float  # along the view [m]
    blade_count: int = 0  # below three the aperture is a disk
    rotation: float = 0.0  # of the blades [rad]
    ratio: float = 1.0  # of the height of the aperture to its width

    def point(self, turn: int) -> np.ndarray:
        """(2,) [m]: the point of the aperture that a pass looks through, the first one through the middle.

        The points of all passes fill the aperture evenly: Halton's sequence, which has nothing in common with that by
        which passes move pixels.
        """
        unit = _disk_point((np.array([_radical_inverse(turn, 2), _radical_inverse(turn, 3)]) + _HALF) % 1.0)
        if self.blade_count >= 3:
            unit = _polygon_point(unit, self.blade_count, self.rotation)
        return self.radius * unit / np.array([self.ratio, 1.0])

    def world_to_view(self, world_to_view: np.ndarray, turn: int) -> np.ndarray:
        """(4, 4) of a pass, from that of the lens' middle: sheared, so that what is in focus stays where it is."""
        x, y = self.point(turn)
        shear = np.eye(4)
        # A ray through (x, y, 0) and the point at which that through the middle meets the plane of focus.
        shear[:2, 2] = -x / self.focus_distance, -y / self.focus_distance
        shear[:2, 3] = -x, -y
        return shear @ world_to_view


def _radical_inverse(index: int, base: int) -> float:
    """The digits of an index behind the point, in reverse."""
    value, place = 0.0, 1.0 / base
    while index:
        index, digit = divmod(index, base)
        value += digit * place
        place /= base
    return value


def _disk_point(square):
    """(2,) in the unit square → (2,) in the unit disk: areas in proportion [Shirley97]."""
    a, b = 2.0 * square - 1.0
    if a == 0.0 and b == 0.0:
        return np.zeros(2)
    if abs(a) > abs(b):
        radius, angle = a, 0.25 * math.pi * b / a
    else:
        radius, angle = b, 0.5 * math.pi - 0.25 * math.pi * a / b
    return radius * np.array([math.cos(angle), math.sin(angle)])


def _polygon_point(disk, corner_count, rotation):
    """(2,) in the unit disk → (2,) in the regular polygon inside it, turned [rad]: the same share of the area."""
    sector = (math.atan2(disk[1], disk[0]) / (2.0 * math.pi) % 1.0) * corner_count
    first = math.floor(sector)
    angles = rotation + (np.array([first, first + 1]) - 0.5) * 2.0 * math.pi / corner_count
    corners = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    along = sector - first
    return float(np.hypot(*disk)) * ((1.0 - along) * corners[0] + along * corners[1])
