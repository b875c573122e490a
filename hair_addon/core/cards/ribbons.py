# SPDX-License-Identifier: GPL-3.0-or-later
"""Clumps of strands → the ribbons that stand for them, and the strands laid flat onto those."""

from dataclasses import dataclass

import numpy as np

from .. import geometry
from ..geometry import clusters
from ..geometry.mesh import TriMesh, interpolate
from . import curve_frames

_OUTWARD = 2.0  # what facing away from the surface weighs beside lying along the spread of a clump
_WINDOW = 0.3  # of the length: strands follow the ribbon from root to tip, also where it comes back to itself
_TINY = 1e-9


@dataclass(frozen=True)
class Axes:
    """The middle lines of C ribbons of n points: centres, tangents, normals, (C, n, 3) each, and distances (C, n)."""

    centres: np.ndarray
    tangents: np.ndarray
    normals: np.ndarray

    @property
    def binormals(self) -> np.ndarray:
        """(C, n, 3) unit vectors across the ribbons: with tangents and normals a right-handed frame."""
        return np.cross(self.tangents, self.normals)

    @property
    def distances(self) -> np.ndarray:
        """(C, n) from the first point, along the lines."""
        lengths = np.linalg.norm(np.diff(self.centres, axis=1), axis=-1)
        return np.concatenate([np.zeros((len(lengths), 1)), np.cumsum(lengths, axis=1)], axis=1)

    def turned(self, angles: np.ndarray) -> "Axes":
        """The same with normals turned around the tangents by (C,) angles [rad]."""
        cosines, sines = np.cos(angles)[:, None, None], np.sin(angles)[:, None, None]
        return Axes(self.centres, self.tangents, cosines * self.normals + sines * self.binormals)


def axes_of(points: np.ndarray, labels: np.ndarray, count: int, segment_count: int, surface: TriMesh) -> Axes:
    """The middle lines of `count` clumps of (S, P, 3) strands; labels (S,): the clump of each strand.

    Lines are the means of their strands, with points where they bend. Normals lie where strands spread least, and face
    away from the surface.
    """
    means = clusters.cluster_means(points, labels, count)
    centres = curve_frames.resample_by_curvature(means, segment_count + 1)
    axes = Axes(centres, curve_frames.tangents(centres), curve_frames.steady_normals(centres))
    return axes.turned(_angles(points, labels, count, axes, _away(centres, surface)))


def _away(places, surface):
    """(C, n, 3) unit normals of the surface where it is nearest to places."""
    nearest = geometry.closest_point.SurfaceQuery(surface).nearest(places.reshape(-1, 3).astype(np.float32))
    return curve_frames.unit(interpolate(surface.vertex_normals, surface, nearest)).reshape(places.shape)


def _angles(points, labels, count, axes, away):
    """(C,) angles [rad] by which normals turn: the least eigenvector of the spread less what faces away."""
    flat = flattened(points, labels, axes)
    across = flat[..., [2, 0]].astype(np.float64)  # along the normal and the binormal
    moments = np.einsum("spi,spj->sij", across, across)
    spread = clusters.cluster_means(moments, labels, count)
    spread /= np.maximum(np.trace(spread, axis1=1, axis2=2), _TINY**2)[:, None, None]
    facing = np.stack([(away * axes.normals).sum(-1), (away * axes.binormals).sum(-1)], axis=-1)
    outward = np.einsum("cni,cnj->cij", facing, facing) / facing.shape[1]
    vectors = np.linalg.eigh(spread - _OUTWARD * outward)[1][:, :, 0]
    vectors *= np.where(np.einsum("ci,cni->c", vectors, facing) < 0.0, -1.0, 1.0)[:, None]
    return np.arctan2(vectors[:, 1], vectors[:, 0])


def flattened(points: np.ndarray, labels: np.ndarray, axes: Axes) -> np.ndarray:
    """(S, P, 3) strands → (S, P, 3) float32 on the ribbons of their clumps: across, along, and above them.

    Each point goes to the nearest of the ribbon's middle line, not far from its own part of the length;
    beyond the ends, and at the outside of bends, it goes on straight.
    """
    points = np.asarray(points, np.float32)
    distances, parts = axes.distances.astype(np.float32), np.linspace(0.0, 1.0, points.shape[1], dtype=np.float32)
    centres = axes.centres.astype(np.float32)
    lengths = np.maximum(distances[labels, -1], _TINY)[:, None]
    least = np.full(points.shape[:2], np.inf, np.float32)
    nearest, places = np.zeros(points.shape[:2], np.int32), np.zeros(points.shape[:2], np.float32)
    for segment in range(distances.shape[1] - 1):
        direction, length = _edges(centres, segment)
        offsets = points - centres[labels, segment][:, None]
        along = np.einsum("spi,si->sp", offsets, direction[labels])
        on_line = np.clip(along, 0.0, length[labels][:, None])
        # Of a point beside its foot on the line: Pythagoras.
        square = np.einsum("spi,spi->sp", offsets, offsets) - along**2 + (along - on_line) ** 2
        away = np.abs((distances[labels, segment][:, None] + on_line) / lengths - parts) - _WINDOW
        cost = square + (np.maximum(away, 0.0) * lengths) ** 2
        is_nearer = cost < least
        least[is_nearer], nearest[is_nearer], places[is_nearer] = cost[is_nearer], segment, on_line[is_nearer]
    return _components(points, labels, axes, nearest, places)


def _edges(centres, segment):
    """((C, 3) unit direction, (C,) length) of a segment."""
    edges = centres[:, segment + 1] - centres[:, segment]
    lengths = np.maximum(np.linalg.norm(edges, axis=1), np.float32(_TINY))
    return edges / lengths[:, None], lengths


def _components(points, labels, axes, nearest, on_line):
    """(S, P, 3) across, along and above, of points whose foot lies on a segment at a distance from its start."""
    centres, normals, distances = (array.astype(np.float32) for array in (axes.centres, axes.normals, axes.distances))
    edges = np.diff(centres, axis=1)
    lengths = np.maximum(np.linalg.norm(edges, axis=-1), np.float32(_TINY))
    card = labels[:, None]
    direction = (edges / lengths[..., None])[card, nearest]
    offsets = points - centres[card, nearest] - on_line[..., None] * direction
    first, second = normals[card, nearest], normals[card, nearest + 1]
    upward = first + (on_line / lengths[card, nearest])[..., None] * (second - first)
    upward -= np.einsum("spi,spi->sp", upward, direction)[..., None] * direction
    upward /= np.maximum(np.linalg.norm(upward, axis=-1, keepdims=True), np.float32(_TINY))
    flat = np.empty(points.shape, np.float32)
    flat[..., 0] = np.einsum("spi,spi->sp", offsets, np.cross(direction, upward))
    flat[..., 1] = np.einsum("spi,spi->sp", offsets, direction) + distances[card, nearest] + on_line
    flat[..., 2] = np.einsum("spi,spi->sp", offsets, upward)
    return flat
