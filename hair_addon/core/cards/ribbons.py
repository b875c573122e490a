# SPDX-License-Identifier: GPL-3.0-or-later
"""Ribbons that represent clumps of strands, and the flattening of strands onto them."""

from dataclasses import dataclass

import numpy as np

from .. import geometry
from ..geometry.curves import curve_frames
from ..geometry.mesh import TriMesh, interpolate
from ..geometry.search import clusters

_WINDOW = 0.3  # of the length: keeps strands in order along ribbons that return to themselves
_TINY = 1e-9


@dataclass(frozen=True)
class Axes:
    """Middle lines of C ribbons of n points: centers, tangents, normals, (C, n, 3) each."""

    centres: np.ndarray
    tangents: np.ndarray
    normals: np.ndarray

    @property
    def binormals(self) -> np.ndarray:
        """Unit vectors (C, n, 3) across the ribbons: tangents × normals."""
        return np.cross(self.tangents, self.normals)

    @property
    def distances(self) -> np.ndarray:
        """Arc lengths (C, n) from the first point."""
        lengths = np.linalg.norm(np.diff(self.centres, axis=1), axis=-1)
        return np.concatenate([np.zeros((len(lengths), 1)), np.cumsum(lengths, axis=1)], axis=1)

    def turned(self, angles: np.ndarray) -> "Axes":
        """Return the axes with normals rotated around the tangents by angles (C,) [rad]."""
        cosines, sines = np.cos(angles)[:, None, None], np.sin(angles)[:, None, None]
        return Axes(self.centres, self.tangents, cosines * self.normals + sines * self.binormals)

    def chosen(self, ribbons: np.ndarray) -> "Axes":
        """Return the axes of some ribbons, by index."""
        return Axes(self.centres[ribbons], self.tangents[ribbons], self.normals[ribbons])


def joined(parts: list[Axes]) -> Axes:
    """Return the axes of all ribbons of several `Axes` with the same number of points."""
    return Axes(
        *(np.concatenate([getattr(part, name) for part in parts]) for name in ("centres", "tangents", "normals"))
    )


def axes_of(
    points: np.ndarray, labels: np.ndarray, count: int, segment_count: int, surface: TriMesh, outward: float = 2.0
) -> Axes:
    """Return the middle lines of `count` clumps of strands (S, P, 3); labels: (S,) clump of each strand.

    A line is the mean of the strands of a clump, resampled by curvature. Normals point in the direction of least
    spread, away from the surface; outward: weight of the direction away from the surface, relative to least spread.
    """
    means = clusters.cluster_means(points, labels, count)
    centres = curve_frames.resample_by_curvature(means, segment_count + 1)
    axes = Axes(centres, curve_frames.tangents(centres), curve_frames.steady_normals(centres))
    return axes.turned(_angles(points, labels, count, axes, _away(centres, surface), outward))


def _away(places, surface):
    """Return unit normals (C, n, 3) of the surface at the points closest to places."""
    nearest = geometry.closest_point.SurfaceQuery(surface).nearest(places.reshape(-1, 3).astype(np.float32))
    return curve_frames.unit(interpolate(surface.vertex_normals, surface, nearest)).reshape(places.shape)


def _angles(points, labels, count, axes, away, outward):
    """Return rotation angles (C,) [rad] that turn normals to the least eigenvector of spread minus outward facing."""
    flat = flattened(points, labels, axes)
    across = flat[..., [2, 0]].astype(np.float64)  # along the normal and the binormal
    moments = np.einsum("spi,spj->sij", across, across)
    spread = clusters.cluster_means(moments, labels, count)
    spread /= np.maximum(np.trace(spread, axis1=1, axis2=2), _TINY**2)[:, None, None]
    facing = np.stack([(away * axes.normals).sum(-1), (away * axes.binormals).sum(-1)], axis=-1)
    toward = np.einsum("cni,cnj->cij", facing, facing) / facing.shape[1]
    vectors = np.linalg.eigh(spread - outward * toward)[1][:, :, 0]
    vectors *= np.where(np.einsum("ci,cni->c", vectors, facing) < 0.0, -1.0, 1.0)[:, None]
    return np.arctan2(vectors[:, 1], vectors[:, 0])


def flattened(points: np.ndarray, labels: np.ndarray, axes: Axes) -> np.ndarray:
    """Return strands (S, P, 3) in ribbon coordinates (S, P, 3) float32 of their clumps: across, along, and above.

    Each point is projected to the closest point of the ribbon's middle line near the same fraction of the length.
    Beyond the ends, and on the outside of bends, the ribbon is extended straight.
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
        # Squared distance from the projection on the segment: Pythagoras.
        square = np.einsum("spi,spi->sp", offsets, offsets) - along**2 + (along - on_line) ** 2
        away = np.abs((distances[labels, segment][:, None] + on_line) / lengths - parts) - _WINDOW
        cost = square + (np.maximum(away, 0.0) * lengths) ** 2
        is_nearer = cost < least
        least[is_nearer], nearest[is_nearer], places[is_nearer] = cost[is_nearer], segment, on_line[is_nearer]
    return _components(points, labels, axes, nearest, places)


def _edges(centres, segment):
    """Return ((C, 3) unit directions, (C,) lengths) of a segment of each ribbon."""
    edges = centres[:, segment + 1] - centres[:, segment]
    lengths = np.maximum(np.linalg.norm(edges, axis=1), np.float32(_TINY))
    return edges / lengths[:, None], lengths


def _components(points, labels, axes, nearest, on_line):
    """Return ribbon coordinates (S, P, 3); nearest: segment of the projection; on_line: distance along the segment."""
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
