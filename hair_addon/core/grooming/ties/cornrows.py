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
_END = 40  # last samples; hair beyond the end continues in their direction
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
    ahead = unit(lifted[-1] - lifted[-_END])
    beyond = lifted[-1] + np.linspace(0.0, reach, _SAMPLES + 1)[1:, None] * ahead
    centers = np.concatenate([lifted, beyond])
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(centers, axis=0), axis=1))])
    tangents = unit(np.gradient(centers, axis=0))
    ups = np.concatenate([normals, np.broadcast_to(normals[-1], beyond.shape)])
    ups = unit(ups - tangents * np.sum(ups * tangents, axis=1, keepdims=True))
    return tie_tails.TailLine(along, centers, unit(np.cross(tangents, ups)), ups, _WIDE)


def ways_along(ways: np.ndarray, line: tie_tails.TailLine, reach: float, settings: GatherSettings) -> np.ndarray:
    """Return the ways (S, M, 3) [m] of guides along a braid for `reach` [m], after ways (S, K, 3) to the braid."""
    arrived = ways[:, -1]
    nearest = np.linalg.norm(arrived[:, None] - line.centers[None, :_SAMPLES], axis=2).argmin(axis=1)
    joined = line.along[nearest] + settings.tie_radius
    # The place and the side at which a guide joins determine its lock, and its place in the lock.
    beside = np.sum((arrived - line.centers[nearest]) * line.sides[nearest], axis=1)
    angles = 2.0 * np.pi * (joined / settings.pitch + 0.25 * np.sign(beside))
    order = np.argsort(np.argsort(joined, kind="stable"))
    ranks = (order * 0.61803399) % 1.0
    along = joined[:, None] + np.linspace(0.0, reach, _SAMPLES)
    centers, sides, ups = line.at(along)
    offsets = tie_tails.offsets(line, angles, ranks, along, settings)
    return centers + offsets[..., :1] * sides + offsets[..., 1:] * ups
