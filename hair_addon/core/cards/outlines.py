# SPDX-License-Identifier: GPL-3.0-or-later
"""Outlines of ribbons, which enclose all their strands, and the mesh of all ribbons."""

from dataclasses import dataclass

import numpy as np

from ..geometry.mesh import Faces
from .polygon_mesh import PolygonMesh
from .ribbons import Axes


@dataclass(frozen=True)
class Outlines:
    """Edges of C ribbons at n places: along, low and high (C, n), in the coordinates of `ribbons.flattened`."""

    along: np.ndarray
    low: np.ndarray
    high: np.ndarray

    @property
    def boxes(self) -> np.ndarray:
        """Bounding boxes (C, 4): least across, least along, width, length."""
        low, high = self.low.min(axis=1), self.high.max(axis=1)
        return np.stack([low, self.along[:, 0], high - low, self.along[:, -1] - self.along[:, 0]], axis=1)

    @property
    def areas(self) -> np.ndarray:
        """Areas (C,) of the flat ribbons."""
        widths = self.high - self.low
        return (0.5 * (widths[:, 1:] + widths[:, :-1]) * np.diff(self.along, axis=1)).sum(axis=1)


def outlines(flat: np.ndarray, radii: np.ndarray, labels: np.ndarray, axes: Axes) -> Outlines:
    """Return the edges of ribbons that enclose flattened strands (S, P, 3) with radii (S, P).

    Places along a ribbon are the points of its axis; the first and the last place move to the ends of its strands.
    """
    count = len(axes.centres)
    order = np.argsort(labels, kind="stable")
    starts = np.searchsorted(labels[order], np.arange(count))
    across, onward, reach = flat[order, :, 0], flat[order, :, 1], radii[order].max(axis=1)
    along = axes.distances
    # The ends of the axis only move outwards.
    along[:, 0] = np.minimum(along[:, 0], np.minimum.reduceat(onward.min(axis=1) - reach, starts))
    along[:, -1] = np.maximum(along[:, -1], np.maximum.reduceat(onward.max(axis=1) + reach, starts))
    of_strand, segment_count = labels[order], along.shape[1] - 1
    near, far = np.minimum(onward[:, 1:], onward[:, :-1]), np.maximum(onward[:, 1:], onward[:, :-1])
    left, right = np.minimum(across[:, 1:], across[:, :-1]), np.maximum(across[:, 1:], across[:, :-1])
    lows, highs = np.empty((2, count, segment_count))
    for segment in range(segment_count):
        begin, end = (along[of_strand, segment + step][:, None] for step in (0, 1))
        is_there = (far + reach[:, None] >= begin) & (near - reach[:, None] <= end)
        lows[:, segment] = np.minimum.reduceat(np.where(is_there, left, np.inf).min(axis=1) - reach, starts)
        highs[:, segment] = np.maximum.reduceat(np.where(is_there, right, -np.inf).max(axis=1) + reach, starts)
    # Segments without strands have zero width.
    is_empty = lows > highs
    lows[is_empty] = highs[is_empty] = 0.0
    return Outlines(along, _at_places(lows, np.minimum), _at_places(highs, np.maximum))


def _at_places(of_segments, farther):
    """Return limits (C, n) at the ends of segments that enclose the limits (C, n - 1) of both adjacent segments."""
    inner = farther(of_segments[:, 1:], of_segments[:, :-1])
    return np.concatenate([of_segments[:, :1], inner, of_segments[:, -1:]], axis=1)


_RIDGE = 1e-4  # regularization relative to all points' weight: places without points stay on the middle line


def heights(flat: np.ndarray, labels: np.ndarray, found: Outlines) -> np.ndarray:
    """Return heights (C, n) of ribbons above the middle line, the least-squares fit to their flattened strands.

    The middle line is the mean of all strands of a clump. A ribbon on the middle line would cut into the surface where
    only some strands are present, for example at roots behind other roots, and where strands bend between places.
    """
    count, last = found.along.shape[0], found.along.shape[1] - 1
    diagonal, beside, sums = np.zeros((3, last + 1, count))
    onward, before = flat[..., 1].astype(np.float64), None
    for place in range(last + 1):
        near = _nearness(found.along[labels], onward, place)
        diagonal[place] = np.bincount(labels, weights=(near**2).sum(axis=1), minlength=count)
        sums[place] = np.bincount(labels, weights=(near * flat[..., 2]).sum(axis=1), minlength=count)
        if before is not None:
            beside[place] = np.bincount(labels, weights=(near * before).sum(axis=1), minlength=count)
        before = near
    diagonal += _RIDGE * diagonal.sum(axis=0) + 1e-30
    # The normal equations are tridiagonal: forward elimination, then back substitution.
    for place in range(1, last + 1):
        share = beside[place] / diagonal[place - 1]
        diagonal[place] -= share * beside[place]
        sums[place] -= share * sums[place - 1]
    solution = np.empty(sums.shape)
    solution[last] = sums[last] / diagonal[last]
    for place in range(last - 1, -1, -1):
        solution[place] = (sums[place] - beside[place + 1] * solution[place + 1]) / diagonal[place]
    return solution.T


def levelled(flat: np.ndarray, labels: np.ndarray, found: Outlines, lifted: np.ndarray) -> np.ndarray:
    """Return flattened strands with heights relative to ribbons lifted by `heights`."""
    above, onward = flat.copy(), flat[..., 1].astype(np.float64)
    for place in range(lifted.shape[1]):
        above[..., 2] -= lifted[labels, place][:, None] * _nearness(found.along[labels], onward, place)
    return above


def _nearness(along, onward, place):
    """Return hat functions (S, P) at points (S, P): 1 at a place, 0 at its neighbors; along: (S, n) of all places."""
    here, near = along[:, place, None], np.ones(onward.shape)
    if place:
        before = along[:, place - 1, None]
        near = np.minimum(near, (onward - before) / np.maximum(here - before, 1e-12))
    if place < along.shape[1] - 1:
        after = along[:, place + 1, None]
        near = np.minimum(near, (after - onward) / np.maximum(after - here, 1e-12))
    return np.maximum(near, 0.0)


def ribbon_mesh(axes: Axes, found: Outlines, uvs: np.ndarray, lifted: np.ndarray) -> PolygonMesh:
    """Return the mesh of all ribbons with two vertices, low and high, at each place.

    uvs: (C, n, 2, 2) of vertices; lifted: (C, n) offsets along the normals of the axes. Faces point along these
    normals.
    """
    count, places, _ = axes.centres.shape
    centres = axes.centres.copy()
    distances = axes.distances
    for end in (0, -1):
        beyond = found.along[:, end] - distances[:, end]
        centres[:, end] += beyond[:, None] * axes.tangents[:, end]
    centres += lifted[..., None] * axes.normals
    edges = np.stack([found.low, found.high], axis=-1)
    vertices = centres[:, :, None] + edges[..., None] * axes.binormals[:, :, None]
    ring = 2 * np.arange(places - 1)
    # Right-handed frame: across (low to high) × along = normal.
    quads = np.stack([ring, ring + 1, ring + 3, ring + 2], axis=1).ravel()
    corners = (quads + (2 * places) * np.arange(count)[:, None]).ravel().astype(np.int32)
    starts = np.arange(0, len(corners) + 1, 4, dtype=np.int32)
    flat_uvs = uvs.reshape(-1, 2)[corners].astype(np.float32)
    return PolygonMesh(vertices.reshape(-1, 3).astype(np.float32), Faces(corners, starts), flat_uvs)
