# SPDX-License-Identifier: GPL-3.0-or-later
"""Buns: hair rises through the tie and is coiled around it, from the top of a flat ball down to the surface.

All guides of a bun have their points at the same places of one line, so that the strands between them are coiled too. A
mean of guides at different places of a coil would be shorter than the coil, and strands, which are lengthened to the
mean length of their guides, would leave it. Guides become as long as the coil, and their ends are tucked in below it.
"""

from dataclasses import dataclass, replace

import numpy as np

from ...geometry import mesh as mesh_math
from ...geometry.closest_point import SurfaceQuery
from ...geometry.mesh import TriMesh
from ..guide_shapes import unit
from . import tie_tails
from .gather_settings import GatherSettings

_FLAT = 1.05  # height of a bun relative to its radius
_OVERLAP = 1.15  # width of the coil relative to the distance of its turns
_INNERMOST = 0.6  # radius of the innermost turn relative to the radius of the coil
_THICKEST = 0.45  # radius of a coil with few turns relative to the bun
_TUCKED = 0.4  # turns of the coil's end, below the coil
_INWARD = 0.5  # radius of the bun where the coil ends, relative to its edge
_END = 0.45  # radius of the coil's end relative to the coil
_STRAIGHT = 0.3  # curvature relative to the median, below which the distance of points stays
_OF_TURN = 6  # least number of segments in a turn
_RISING, _COILED, _TUCKING = 60, 2000, 200  # points of the parts of the line


@dataclass(frozen=True)
class Bun:
    """The middle of a coil as a `TailLine`, and the radii (M,) [m] of the hair at its points."""

    line: tie_tails.TailLine
    radii: np.ndarray

    def places(self, count: int) -> np.ndarray:
        """Return (count,) places [m] along the line, from the tie to its end, closer together where it bends more."""
        tangents = np.gradient(self.line.centers, self.line.along, axis=0)
        bends = np.linalg.norm(np.gradient(tangents, self.line.along, axis=0), axis=1)
        # A chord of length s is s² bend / 8 away from its arc.
        dense = np.sqrt(np.maximum(bends, _STRAIGHT * np.median(bends)))
        number = np.concatenate([[0.0], np.cumsum(0.5 * (dense[1:] + dense[:-1]) * np.diff(self.line.along))])
        return np.interp(np.linspace(0.0, number[-1], count), number, self.line.along)

    def points(self, angles: np.ndarray, ranks: np.ndarray, count: int) -> np.ndarray:
        """Return (S, count, 3) [m]: points of guides along the coil.

        angles (S,), ranks (S,) in [0, 1]: the place in the disk of the tie by equal area.
        """
        along = self.places(count)
        centers, sides, ups = self.line.at(along)
        size = np.sqrt(ranks)[:, None] * np.interp(along, self.line.along, self.radii)
        across = np.cos(angles)[:, None, None] * sides + np.sin(angles)[:, None, None] * ups
        return centers + size[..., None] * across


def with_points_enough(settings: GatherSettings, segments: int) -> GatherSettings:
    """Return settings with at most as many turns as a number of segments in the bun can follow."""
    return replace(settings, turns=min(settings.turns, max(segments, 1) / _OF_TURN))


def wound(mesh: TriMesh, query: SurfaceQuery, line: np.ndarray, settings: GatherSettings) -> Bun:
    """Return the `Bun` at the first point of a line (K, 3) [m]. The coil begins in the direction of the line."""
    tie = query.nearest(line[:1])
    normal = mesh_math.normals(mesh, tie)[0].astype(np.float64)
    start = unit(line[1] - line[0])
    side = start - normal * (start @ normal)
    side = unit(side) if np.linalg.norm(side) > 0.1 else unit(np.cross(normal, np.eye(3)[np.abs(normal).argmin()]))
    turn, beside, above, radii = _coil(settings)
    flat = beside[:, None] * (np.cos(turn)[:, None] * side + np.sin(turn)[:, None] * np.cross(normal, side))
    # The edge of the bun follows the surface, which bends away from the tie.
    ground = mesh_math.positions(mesh, query.nearest(line[0] + flat)).astype(np.float64)
    lower = np.clip((ground - line[0]) @ normal, -0.5 * settings.bun_radius, 0.5 * settings.bun_radius)
    points = line[0] + flat + (settings.clearance + above + lower)[:, None] * normal
    lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    found = tie_tails.framed(points, normal, lengths[-1])
    return Bun(found, np.interp(np.linspace(0.0, lengths[-1], len(found.along)), lengths, radii))


def coil_radius(settings: GatherSettings) -> float:
    """Return the radius [m] of a coil whose turns lie beside each other from the top of a bun to its edge."""
    # A quarter of an ellipse is nearly as long as that of a circle whose radius is the mean of R - r and _FLAT R - 2 r.
    quarter = 0.25 * np.pi * _OVERLAP
    fitting = quarter * (1.0 + _FLAT) / (2.0 * settings.turns + 3.0 * quarter)
    return min(fitting, _THICKEST) * settings.bun_radius


def _coil(settings):
    """Return the middle of a coil in cylindrical coordinates (M,) around the tie, and its radii (M,).

    The coordinates are angles [rad], distances from the axis and heights [m].
    """
    radius = coil_radius(settings)
    wide = settings.bun_radius - radius
    high = _FLAT * settings.bun_radius - 2.0 * radius
    tilt = np.linspace(np.arcsin(min(_INNERMOST * radius / wide, 0.9)), 0.5 * np.pi, _COILED)
    beside, above = wide * np.sin(tilt), radius + high * np.cos(tilt)
    meridian = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(beside), np.diff(above)))])
    turn = 2.0 * np.pi * settings.turns * meridian / meridian[-1]
    rising = np.linspace(0.0, 1.0, _RISING, endpoint=False)
    tucking = np.linspace(0.0, 1.0, _TUCKING + 1)[1:]
    ease = tie_tails.ease
    return (
        np.concatenate([0.0 * rising, turn, turn[-1] + 2.0 * np.pi * _TUCKED * tucking]),
        np.concatenate([0.0 * rising, beside, wide * (1.0 - (1.0 - _INWARD) * ease(tucking))]),
        np.concatenate([above[0] * rising, above, radius * (1.0 - (1.0 - _END) * ease(tucking))]),
        np.concatenate(
            [
                settings.tie_radius + ease(rising) * (radius - settings.tie_radius),
                np.full(_COILED, radius),
                radius * (1.0 - (1.0 - _END) * ease(tucking)),
            ]
        ),
    )
