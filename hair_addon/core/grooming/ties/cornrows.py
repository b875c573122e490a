# SPDX-License-Identifier: GPL-3.0-or-later
"""Cornrows: guides go over the surface to the nearest drawn line, and along it as a braid that lies on the surface.

The way of a root to its row descends the distance from the whole line. At the row, the guide joins the lock that is
outermost on its side, and follows it to the end of the row and of its tail.

From the place where it joins the row, each guide has its points at the same places of the row as all others: a strand
is a mean of its guides, and a mean of different places of a lock lies outside of the braid. So the guides of a row
become long enough to end together. Because guides have few points, a pitch has six, at which the three locks are at the
same places.
"""

from dataclasses import dataclass

import numpy as np

from ...geometry import mesh as mesh_math
from ...geometry.closest_point import SurfaceQuery
from ...geometry.mesh import TriMesh
from ..guide_shapes import unit
from . import tie_tails
from .gather_settings import GatherSettings

_SAMPLES = 400  # points of a line on the surface
_END = 20  # samples over which the direction at the end is averaged
_RISE = 0.75  # height of a braid's middle above its clearance, relative to its radius
_ON_WAY = 4  # least number of segments of a guide before it follows a row
_OF_PITCH = 6  # segments in which a lock returns to its place
_ASIDE, _ABOVE, _LOCK = 0.62, 0.36, 0.42  # path of a lock across the braid, and its radius, relative to the braid's


@dataclass(frozen=True)
class Row:
    """The middle of a braid; on_surface: length [m] of the part on the surface; places (K,) [m]: of points along it."""

    line: tie_tails.TailLine
    on_surface: float
    places: np.ndarray
    pitch: float


def on_surface(query: SurfaceQuery, mesh: TriMesh, line: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return points and normals (M, 3) of the surface below a line (K, 3) [m], at even distances."""
    steps = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    along = np.linspace(0.0, steps[-1], _SAMPLES)
    places = query.nearest(np.stack([np.interp(along, steps, line[:, axis]) for axis in range(3)], axis=1))
    return mesh_math.positions(mesh, places).astype(np.float64), mesh_math.normals(mesh, places).astype(np.float64)


def row(points: np.ndarray, normals: np.ndarray, tail: float, segments: int, settings: GatherSettings) -> Row:
    """Return the `Row` over points (M, 3) [m] of the surface, with a straight tail [m]; segments: per guide."""
    lifted = points + (settings.clearance + _RISE * settings.tie_radius) * normals
    # The derivative at the end, of second order: hair goes on in the direction of a curved row's end.
    ahead = unit(3.0 * lifted[-1] - 4.0 * lifted[-1 - _END] + lifted[-1 - 2 * _END])
    beyond = lifted[-1] + np.linspace(0.0, tail, _SAMPLES + 1)[1:, None] * ahead
    centers = np.concatenate([lifted, beyond])
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(centers, axis=0), axis=1))])
    tangents = unit(np.gradient(centers, axis=0))
    ups = np.concatenate([normals, np.broadcast_to(normals[-1], beyond.shape)])
    ups = unit(ups - tangents * np.sum(ups * tangents, axis=1, keepdims=True))
    line = tie_tails.TailLine(along, centers, unit(np.cross(tangents, ups)), ups, max(tail, 1e-9))
    count = max(segments - min(_ON_WAY, segments - 1), 1)
    places = np.linspace(0.0, along[-1], count + 1)
    return Row(line, float(along[_SAMPLES - 1]), places, max(settings.pitch, _OF_PITCH * float(places[1])))


def joined_at(row: Row, ways: np.ndarray, settings: GatherSettings) -> tuple[np.ndarray, np.ndarray]:
    """Return the places (S,) [m] along a row at which guides join it, and the locks (S,) that they join.

    ways (S, K, 3) [m]: from the roots to the row.
    """
    arrived, radius = ways[:, -1], settings.tie_radius
    nearest = _nearest(row.line, arrived)
    # Ways over faces arrive less evenly than their roots lie beside the line.
    before = row.line.along[_nearest(row.line, ways[:, 0])]
    places = np.clip(before, row.line.along[nearest] - radius, row.line.along[nearest] + radius) + radius
    # A guide joins the lock that is outermost on the side from which it comes. Its place in the lock changes little
    # with its place on the surface.
    beside = np.sum((arrived - row.line.centers[nearest]) * row.line.sides[nearest], axis=1)
    count = tie_tails.LOCKS["CORNROWS"]
    return places, np.rint(count * (0.25 * np.sign(beside) - places / row.pitch)).astype(int) % count


def points_of(
    row: Row, places: np.ndarray, ranks: np.ndarray, locks: np.ndarray, settings: GatherSettings
) -> np.ndarray:
    """Return (S, K, 3) [m]: guides at the places (K,) of a row.

    places (S,) [m]: where they join; ranks (S,) in [0, 1]: of the lengths of their ways, from the shortest on; locks
    (S,): that they belong to.
    """
    along, line = row.places, row.line
    radius = settings.tie_radius * (0.6 + 0.4 * tie_tails.ease(along / row.pitch))
    end = tie_tails.second_tie(along, settings.tie_radius, line.reach)
    radius = radius * tie_tails.narrowed(along, min(row.on_surface, end), end, settings.tie_radius)
    share = tie_tails.ease((end - along) / (0.5 * row.pitch))  # of the braid, which becomes a tuft
    phase = 2.0 * np.pi * (along / row.pitch + (locks / tie_tails.LOCKS["CORNROWS"])[:, None])
    angles = 2.0 * np.pi * tie_tails.LOCKS["CORNROWS"] * places / row.pitch
    own = np.sqrt(ranks)[:, None] * (1.0 + share * (_LOCK - 1.0))
    aside = share * _ASIDE * np.sin(phase) + own * np.cos(angles)[:, None]
    above = share * _ABOVE * np.sin(2.0 * phase) + own * np.sin(angles)[:, None]
    centers, sides, ups = line.at(along)
    return centers + (radius * aside)[..., None] * sides + (radius * above)[..., None] * ups


def _nearest(line, points):
    """Return (S,) indices of the places on the surface part of a line that are nearest to points (S, 3)."""
    return np.linalg.norm(points[:, None] - line.centers[None, :_SAMPLES], axis=2).argmin(axis=1)
