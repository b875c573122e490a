# SPDX-License-Identifier: GPL-3.0-or-later
"""Outlines of ribbons, within which all their strands lie, and the mesh of all ribbons."""

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
        """(C, 4): least across, least along, width, length."""
        low, high = self.low.min(axis=1), self.high.max(axis=1)
        return np.stack([low, self.along[:, 0], high - low, self.along[:, -1] - self.along[:, 0]], axis=1)

    @property
    def areas(self) -> np.ndarray:
        """(C,) of the flat ribbons."""
        widths = self.high - self.low
        return (0.5 * (widths[:, 1:] + widths[:, :-1]) * np.diff(self.along, axis=1)).sum(axis=1)


def outlines(flat: np.ndarray, radii: np.ndarray, labels: np.ndarray, axes: Axes) -> Outlines:
    """The edges of ribbons around flattened strands (S, P, 3) with (S, P) radii: nothing of them lies outside.

    Places along a ribbon are those of its axis, the first and last moved to where its strands end.
    """
    count = len(axes.centres)
    order = np.argsort(labels, kind="stable")
    starts = np.searchsorted(labels[order], np.arange(count))
    across, onward, reach = flat[order, :, 0], flat[order, :, 1], radii[order].max(axis=1)
    along = axes.distances
    # Ends stay outside of what lies between them.
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
    # No strand is in some segment of a ribbon: it is as narrow there as can be.
    is_empty = lows > highs
    lows[is_empty] = highs[is_empty] = 0.0
    return Outlines(along, _at_places(lows, np.minimum), _at_places(highs, np.maximum))


def _at_places(of_segments, farther):
    """(C, n - 1) limits of segments → (C, n) at their ends, of which none cuts off a segment beside it."""
    inner = farther(of_segments[:, 1:], of_segments[:, :-1])
    return np.concatenate([of_segments[:, :1], inner, of_segments[:, -1:]], axis=1)


_RIDGE = 1e-4  # of all points' weight: places that none is near to stay on the middle line


def heights(flat: np.ndarray, labels: np.ndarray, found: Outlines) -> np.ndarray:
    """(C, n) heights above the middle line at which a ribbon lies nearest to its flattened strands: least squares.

    Where only some strands of a clump are, as at the roots of those that stand behind the others, the mean of all of
    them is not where these are, and between places strands bend: a ribbon there would cut into the surface.
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
    # The normal equations have three diagonals: elimination downwards, then upwards.
    for place in range(1, last + 1):
        share = beside[place] / diagonal[place - 1]
        diagonal[place] -= share * beside[place]
        sums[place] -= share * sums[place - 1]
    made = np.empty(sums.shape)
    made[last] = sums[last] / diagonal[last]
    for place in range(last - 1, -1, -1):
        made[place] = (sums[place] - beside[place + 1] * made[place + 1]) / diagonal[place]
    return made.T


def levelled(flat: np.ndarray, labels: np.ndarray, found: Outlines, lifted: np.ndarray) -> np.ndarray:
    """Flattened strands with heights above ribbons that were lifted by `heights`."""
    above, onward = flat.copy(), flat[..., 1].astype(np.float64)
    for place in range(lifted.shape[1]):
        above[..., 2] -= lifted[labels, place][:, None] * _nearness(found.along[labels], onward, place)
    return above


def _nearness(along, onward, place):
    """(S, P) from 1 at a place to 0 at those beside it, of points at (S, P); along (S, n): the places."""
    here, near = along[:, place, None], np.ones(onward.shape)
    if place:
        before = along[:, place - 1, None]
        near = np.minimum(near, (onward - before) / np.maximum(here - before, 1e-12))
    if place < along.shape[1] - 1:
        after = along[:, place + 1, None]
        near = np.minimum(near, (after - onward) / np.maximum(after - here, 1e-12))
    return np.maximum(near, 0.0)


def ribbon_mesh(axes: Axes, found: Outlines, uvs: np.ndarray, lifted: np.ndarray) -> PolygonMesh:
    """The mesh of all ribbons, two vertices at each place of a ribbon, low and high; uvs: (C, n, 2, 2) of them.

    Faces look along the normals of the axes; lifted: (C, n) how far along them.
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
    # Low to high is across, and with along and the normal a right-handed frame: across × along = normal.
    quads = np.stack([ring, ring + 1, ring + 3, ring + 2], axis=1).ravel()
    corners = (quads + (2 * places) * np.arange(count)[:, None]).ravel().astype(np.int32)
    starts = np.arange(0, len(corners) + 1, 4, dtype=np.int32)
    flat_uvs = uvs.reshape(-1, 2)[corners].astype(np.float32)
    return PolygonMesh(vertices.reshape(-1, 3).astype(np.float32), Faces(corners, starts), flat_uvs)
