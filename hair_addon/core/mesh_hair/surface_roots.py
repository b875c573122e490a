# SPDX-License-Identifier: GPL-3.0-or-later
"""Roots of the strands of a hair mesh on the surface that the hair grows on."""

from dataclasses import replace

import numpy as np

from ..geometry.closest_point import SurfaceQuery
from ..geometry.mesh import TriMesh, normals, positions
from .mesh_strands import MeshStrands

_REACH = 0.25  # distance of a root to the surface, relative to the strand's length, that is bridged
_TOUCHING = 1e-5  # distance of a root on the surface, relative to the strand's length
_INWARD = 0.2  # mean cosine between normals and the directions from the center, below which normals point inward


def on_surface(strands: MeshStrands, surface: TriMesh) -> MeshStrands:
    """Return strands that begin on a surface [m]: cut where they leave it, or extended from the closest point.

    Strands that begin far from it, or stay inside, do not change. Normals that point inward
    count as if they pointed outward.
    """
    query, starts = SurfaceQuery(surface), strands.starts
    points = strands.points.astype(np.float64)
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    steps[starts[1:-1] - 1] = 0.0
    lengths = np.add.reduceat(np.append(steps, 0.0), starts[:-1])
    heights = _outward(surface) * _heights(query, surface, points)
    place = np.arange(len(points)) - np.repeat(starts[:-1], strands.counts)
    is_out = (heights > 0.0) & (place <= np.repeat(strands.counts // 2, strands.counts))
    first = np.minimum.reduceat(np.where(is_out, place, len(points)), starts[:-1])
    is_cut = (first > 0) & (first < len(points))
    at = starts[:-1] + np.where(is_cut, first, 0)
    before = at - is_cut
    share = np.where(is_cut, heights[before] / np.where(is_cut, heights[before] - heights[at], 1.0), 0.0)[:, None]
    leaving = points[before] + share * (points[at] - points[before])
    roots = positions(surface, query.nearest(leaving)).astype(np.float64)
    apart = np.linalg.norm(roots - points[at], axis=1)
    is_outside = first < len(points)
    is_extended = is_outside & (apart > _TOUCHING * lengths)
    is_extended &= (np.linalg.norm(roots - leaving, axis=1) <= _REACH * lengths) & (lengths > 0.0)
    # The last point of a cut strand inside the surface becomes its root; other strands get a new first point.
    is_new = is_extended & ~is_cut
    keeps = place >= np.repeat(np.where(is_cut & is_extended, first - 1, 0), strands.counts)
    moved = strands.points.copy()
    moved[before[is_extended & is_cut]] = roots[is_extended & is_cut]
    kept = replace(strands, points=moved)
    if not keeps.all():
        kept = kept.some(keeps)
    order = np.repeat(np.arange(len(kept.points)), 1 + _firsts(kept, is_new))
    grown = replace(
        kept,
        points=kept.points[order],
        counts=kept.counts + is_new,
        radii=kept.radii[order],
        places=kept.places[order],
    )
    grown.points[grown.starts[:-1][is_new]] = roots[is_new]
    return grown


def _firsts(strands, is_chosen):
    found = np.zeros(len(strands.points), int)
    found[strands.starts[:-1][is_chosen]] = 1
    return found


def _outward(surface):
    """Return -1 for a surface whose normals point inward, such as a mirrored mesh, else 1."""
    away = surface.corners.mean(axis=1) - np.average(
        surface.corners.mean(axis=1), axis=0, weights=surface.areas + 1e-30
    )
    facing = 0.5 * np.einsum("fi,fi->f", away, surface.scaled_normals)
    reach = np.linalg.norm(away, axis=1) @ surface.areas
    return -1.0 if facing.sum() < -_INWARD * reach else 1.0


def _heights(query, surface, points):
    """Return heights (N,) [m] above a surface, negative inside."""
    near = query.nearest(points)
    return np.einsum("ni,ni->n", points - positions(surface, near), normals(surface, near))
