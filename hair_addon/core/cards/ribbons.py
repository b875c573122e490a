# SPDX-License-Identifier: GPL-3.0-or-later
"""Clumps of strands → the ribbons that stand for them, and the strands laid flat onto those."""

from dataclasses import dataclass

import numpy as np

from ..geometry.closest_point import SurfaceQuery
from ..geometry.mesh import TriMesh, interpolate
from . import clusters, curve_frames

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
    nearest = SurfaceQuery(surface).nearest(places.reshape(-1, 3).astype(np.float32))
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
    distances, parts = axes.distances, np.linspace(0.0, 1.0, points.shape[1])
    lengths = np.maximum(distances[:, -1], _TINY)
    nearest = np.full(points.shape[:2], np.inf)
    flat = np.empty(points.shape, np.float32)
    for segment in range(distances.shape[1] - 1):
        start, end = axes.centres[:, segment], axes.centres[:, segment + 1]
        length = np.maximum(np.linalg.norm(end - start, axis=1), _TINY)
        direction = ((end - start) / length[:, None])[labels]
        offsets = points - start[labels][:, None]
        along = np.einsum("spi,si->sp", offsets, direction)
        part = np.clip(along / length[labels][:, None], 0.0, 1.0)
        on_line = part * length[labels][:, None]
        offsets = offsets - on_line[..., None] * direction[:, None]
        place = distances[labels, segment][:, None] + on_line
        away = np.abs(place / lengths[labels][:, None] - parts) - _WINDOW
        cost = (offsets**2).sum(-1) + (np.maximum(away, 0.0) * lengths[labels][:, None]) ** 2
        is_nearer = cost < nearest
        nearest[is_nearer] = cost[is_nearer]
        at = _components(offsets, part, direction, axes, labels, segment)
        at[..., 1] += place
        flat[is_nearer] = at[is_nearer]
    return flat


def _components(offsets, part, direction, axes, labels, segment):
    """(S, P, 3) offsets from a segment, across, along and above the ribbon there."""
    first, second = (axes.normals[:, point][labels][:, None] for point in (segment, segment + 1))
    normals = first + part[..., None] * (second - first)
    normals -= np.einsum("spi,si->sp", normals, direction)[..., None] * direction[:, None]
    normals = curve_frames.unit(normals)
    binormals = np.cross(direction[:, None], normals)
    pairs = (binormals, direction[:, None], normals)
    return np.stack([(offsets * axis).sum(-1) for axis in pairs], axis=-1)
