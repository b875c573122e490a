# SPDX-License-Identifier: GPL-3.0-or-later
"""Closed tubes around strands."""

import numpy as np

from ..errors import HairError
from ..geometry.curves import curve_frames
from ..geometry.mesh import Faces
from .card_settings import TubeSettings
from .polygon_mesh import PolygonMesh

_LEAST_RADIUS = 0.01  # relative to the radius without taper: the ring at the tip must not collapse


def chosen_strands(strand_count: int, tube_count: int) -> np.ndarray:
    """Return indices (tube_count,) of evenly spaced strands."""
    return np.arange(tube_count) * strand_count // max(tube_count, 1)


def tubes(
    points: np.ndarray, radii: np.ndarray, settings: TubeSettings, colors: np.ndarray | None = None
) -> PolygonMesh:
    """Return tubes around the chosen strands: points (S, P, 3), resampled by curvature; radii (S, P) in the same unit.

    colors: linear RGB (S, P, 3), which the vertices get; None for the color of the material.
    Both ends are closed. U runs around the tube, V from root 0 to tip 1; end caps have the coordinates of their rings.
    Raises `HairError`.
    """
    if not np.isfinite(points).all():
        raise HairError("Some strands have non-finite coordinates: regenerate the hair.")
    settings.require_size(len(points))
    chosen = chosen_strands(len(points), settings.count_of(len(points)))
    curves = curve_frames.resample_by_curvature(points[chosen], settings.point_count)
    normals = curve_frames.steady_normals(curves)
    binormals = np.cross(curve_frames.tangents(curves), normals)
    along = _parts(curves)
    widths = _resampled(along, radii[chosen])
    if colors is not None:
        rings = np.stack([_resampled(along, colors[chosen][..., channel]) for channel in range(3)], axis=-1)
        colors = np.repeat(rings.reshape(-1, 3), settings.side_count, axis=0).astype(np.float32)
    widths *= settings.thickness * np.maximum(1.0 - settings.taper * along, _LEAST_RADIUS)
    turns = np.arange(settings.side_count) * (2.0 * np.pi / settings.side_count)
    across = np.cos(turns)[:, None] * normals[:, :, None] + np.sin(turns)[:, None] * binormals[:, :, None]
    vertices = curves[:, :, None] + widths[:, :, None, None] * across
    faces, uvs = _topology(len(chosen), settings.point_count, settings.side_count)
    rows = np.clip(uvs[:, 1].astype(int), 0, None)  # V is an index of points up to here
    uvs[:, 1] = along.ravel()[rows]
    return PolygonMesh(vertices.reshape(-1, 3).astype(np.float32), faces, uvs.astype(np.float32), colors)


def _resampled(along, values):
    """Return values (C, P) of evenly spaced positions at the positions `along` (C, N)."""
    positions = np.linspace(0.0, 1.0, values.shape[1])
    return np.stack([np.interp(part, positions, row) for part, row in zip(along, values, strict=True)])


def _parts(curves):
    """Return normalized arc lengths (C, P)."""
    lengths = np.linalg.norm(np.diff(curves, axis=1), axis=-1)
    sums = np.concatenate([np.zeros((len(curves), 1)), np.cumsum(lengths, axis=1)], axis=1)
    return sums / np.maximum(sums[:, -1:], 1e-12)


def _topology(count, points, sides):
    """Return (faces, (corners, 2) U and point index): quads of each tube, then its two end caps."""
    ring, side = (grid.ravel() for grid in np.meshgrid(np.arange(points - 1), np.arange(sides), indexing="ij"))
    after = (side + 1) % sides
    quads = np.stack(
        [ring * sides + side, ring * sides + after, (ring + 1) * sides + after, (ring + 1) * sides + side], axis=1
    )
    quad_u = np.stack([side, side + 1, side + 1, side], axis=1) / sides
    quad_rows = np.stack([ring, ring, ring + 1, ring + 1], axis=1)
    root, tip = np.arange(sides)[::-1], (points - 1) * sides + np.arange(sides)
    corners = np.concatenate([quads.ravel(), root, tip])
    rows = np.concatenate([quad_rows.ravel(), np.zeros(sides), np.full(sides, points - 1)])
    around = np.concatenate([quad_u.ravel(), np.arange(sides)[::-1] / sides, np.arange(sides) / sides])
    sizes = np.concatenate([np.full(len(quads), 4), [sides, sides]])
    first = np.arange(count)[:, None]
    every = (corners + first * (points * sides)).ravel().astype(np.int32)
    starts = np.concatenate([[0], np.cumsum(np.tile(sizes, count))]).astype(np.int32)
    uvs = np.stack([np.tile(around, count), (rows + first * points).ravel()], axis=1)
    return Faces(every, starts), uvs
