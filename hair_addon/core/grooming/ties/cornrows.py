# SPDX-License-Identifier: GPL-3.0-or-later
"""Cornrows: guides go over the surface to the nearest drawn line, and along it as a braid that lies on the surface.

The way of a root to its line descends the distance from the whole line. At the line, the guide joins the braid and
follows it to the end of the line; longer hair continues straight ahead.
"""

import numpy as np

from ...geometry import mesh as mesh_math
from ...geometry.closest_point import SurfaceQuery
from ...geometry.mesh import TriMesh
from ..guide_shapes import unit
from . import tie_tails
from .gather_settings import GatherSettings

_SAMPLES = 400  # points of a line on the surface
_END = 20  # samples over which the direction at the end is averaged
_WIDE = 1e9  # reach of a braid that does not taper [m]
_RISE = 0.6  # height of a braid's middle above its clearance, relative to its radius


def on_surface(query: SurfaceQuery, mesh: TriMesh, line: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return points and normals (M, 3) of the surface below a line (K, 3) [m], at even distances."""
    steps = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    along = np.linspace(0.0, steps[-1], _SAMPLES)
    places = query.nearest(np.stack([np.interp(along, steps, line[:, axis]) for axis in range(3)], axis=1))
    return mesh_math.positions(mesh, places).astype(np.float64), mesh_math.normals(mesh, places).astype(np.float64)


def braid_line(points: np.ndarray, normals: np.ndarray, reach: float, settings: GatherSettings) -> tie_tails.TailLine:
    """Return the middle of a braid over points (M, 3) [m] of the surface, continued straight by `reach` [m]."""
    lifted = points + (settings.clearance + _RISE * settings.tie_radius) * normals
    # The derivative at the end, of second order: hair goes on in the direction of a curved row's end.
    ahead = unit(3.0 * lifted[-1] - 4.0 * lifted[-1 - _END] + lifted[-1 - 2 * _END])
    beyond = lifted[-1] + np.linspace(0.0, reach, _SAMPLES + 1)[1:, None] * ahead
    centers = np.concatenate([lifted, beyond])
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(centers, axis=0), axis=1))])
    tangents = unit(np.gradient(centers, axis=0))
    ups = np.concatenate([normals, np.broadcast_to(normals[-1], beyond.shape)])
    ups = unit(ups - tangents * np.sum(ups * tangents, axis=1, keepdims=True))
    return tie_tails.TailLine(along, centers, unit(np.cross(tangents, ups)), ups, _WIDE)


def ways_along(
    ways: np.ndarray, ranks: np.ndarray, line: tie_tails.TailLine, reach: float, settings: GatherSettings
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the ways (S, M, 3) [m] of guides along a braid for `reach` [m], the locks (S,) that they join, and the
    lengths (S,) [m] from there to the end of the row.

    ways (S, K, 3): the ways to the braid; ranks (S,) in [0, 1]: of their lengths, from the shortest on.
    """
    arrived, radius = ways[:, -1], settings.tie_radius
    nearest = _nearest(line, arrived)
    # Ways over faces arrive less evenly than their roots lie beside the line.
    before = line.along[_nearest(line, ways[:, 0])]
    joined = np.clip(before, line.along[nearest] - radius, line.along[nearest] + radius) + radius
    # A guide joins the lock that is outermost on the side from which it comes. Its place in the lock changes little
    # with its place on the surface.
    beside = np.sum((arrived - line.centers[nearest]) * line.sides[nearest], axis=1)
    turns = joined / settings.pitch
    count = tie_tails.LOCKS["CORNROWS"]
    locks = np.rint(count * (0.25 * np.sign(beside) - turns)).astype(int) % count
    angles = 2.0 * np.pi * turns
    along = joined[:, None] + np.linspace(0.0, reach, _SAMPLES)
    centers, sides, ups = line.at(along)
    offsets = tie_tails.offsets(line, angles, ranks, along, locks, settings)
    return (
        centers + offsets[..., :1] * sides + offsets[..., 1:] * ups,
        locks,
        np.maximum(line.along[_SAMPLES - 1] - joined, 0.0),
    )


def _nearest(line, points):
    """Return (S,) indices of the places on the surface part of a line that are nearest to points (S, 3)."""
    return np.linalg.norm(points[:, None] - line.centers[None, :_SAMPLES], axis=2).argmin(axis=1)
