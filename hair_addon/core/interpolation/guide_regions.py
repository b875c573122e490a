# SPDX-License-Identifier: GPL-3.0-or-later
"""Regions of guides, by regions of the surface and part lines: integers, equal for guides whose hair may touch.

A guide is on the side of a part line to which its path is shorter. Paths do not cross lines, so a closed line, or one
from border to border, divides guides as it divides the surface. Beyond an open end, the sides continue straight ahead,
each with the guides that are nearer to it.
"""

import itertools
from collections.abc import Sequence

import numpy as np
import warp as wp

from ..geometry import closest_point, root_frames
from ..geometry.mesh import SurfacePoints, TriMesh
from . import part_lines
from .part_lines import PartLines
from .regions import Regions, region_labels

_APART = 1.0 / 16.0  # distance of side points from a line, as a fraction of the distance between its points
_NEAREST = 8  # nearest side points, on each side of a line, to which paths of a guide are measured
_AT_ENDS = 8  # points that define a line's direction at its ends: fewer would follow single faces of the surface
_ROWS = 4096  # guides that are compared with a line at once


def guide_regions(
    mesh: TriMesh,
    roots: SurfacePoints,
    regions: Sequence[Regions] = (),
    lines: PartLines | None = None,
    device: wp.DeviceLike = "cpu",
) -> np.ndarray:
    """Return (G,) int32, equal for guides in the same regions and on the same side of each line.

    The numbers are from `combined`. mesh: checked, with the guides' roots on it; lines: laid on it, or None.
    """
    labels = [np.zeros(len(roots), np.int32)]
    apart = region_labels(regions, roots, roots)
    if apart is not None:
        labels.append(apart[1])
    if lines is not None:
        labels += _sides(mesh, roots, lines, device)
    return combined(labels)


def combined(labels: Sequence[np.ndarray]) -> np.ndarray:
    """Return (G,) int32, equal where all labels (G,) are equal, numbered in the order of guides; at least one label."""
    rows = np.stack([label.astype(np.int64) for label in labels], axis=1)
    _, first, numbers = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    return np.argsort(np.argsort(first))[numbers.reshape(-1)].astype(np.int32)


def _sides(mesh, roots, lines, device):
    """Yield (G,) bool for each line with at least one edge: whether guides are on its left."""
    surface = closest_point.SurfaceQuery(mesh, device=device)
    frames = root_frames.rooted(mesh, roots, device)
    points, starts = lines.points.numpy().astype(np.float64), lines.starts.numpy()
    found = []
    for (start, end), kind in zip(itertools.pairwise(starts), lines.ends.numpy(), strict=True):
        line = points[start:end]
        edges = np.diff(line, axis=0)
        is_long = np.linalg.norm(edges, axis=1) > 0.0
        if not is_long.any():
            continue
        firsts, edges = line[:-1][is_long], edges[is_long]
        places = surface.nearest(np.concatenate([firsts + 0.25 * edges, firsts + 0.75 * edges]))
        if not kind & part_lines.CLOSED:
            count = min(_AT_ENDS, len(line) // 2)
            edges[0], edges[-1] = line[count] - line[0], line[-1] - line[-1 - count]
        on_line = root_frames.rooted(mesh, places, device)
        found.append(_is_left(frames, on_line, np.concatenate([edges, edges]), lines))
    return found


def _is_left(frames, on_line, edges, lines):
    """Return (G,) bool for roots with frames (positions, normals); on_line: frames of at least two points of a line.

    edges: (M, 3) of the line there [m]. False for roots without a path to the line, because other lines are in between.
    """
    roots, normals = frames
    positions, places, ups = roots.numpy(), on_line[0].numpy(), on_line[1].numpy()
    device, count = roots.device, len(places)
    left = np.cross(ups, edges)
    left *= _APART * np.median(np.linalg.norm(edges, axis=1)) / np.maximum(np.linalg.norm(left, axis=1), 1e-30)[:, None]
    beside = np.concatenate([places + left, places - left]).astype(np.float32)  # points on the left first
    candidates = np.concatenate(
        [_nearest(positions, beside[:count]), count + _nearest(positions, beside[count:])], axis=1
    )
    ways = np.linalg.norm(positions[:, None] - beside[candidates], axis=2)
    order = np.argsort(ways, axis=1, kind="stable")
    candidates = wp.array(np.take_along_axis(candidates, order, axis=1), dtype=int, device=device)
    ways = wp.array(np.take_along_axis(ways, order, axis=1), dtype=float, device=device)
    there = wp.array(beside, dtype=wp.vec3, device=device)
    facing = wp.array(np.concatenate([ups, ups]), dtype=wp.vec3, device=device)
    part_lines.go_around(lines, roots, normals, there, facing, candidates, ways)
    # If all paths are infinite, the first one is unchanged.
    return (candidates.numpy()[:, 0] < count) & np.isfinite(ways.numpy()[:, 1])


def _nearest(positions, places):
    """Return (G, K) int32: the points nearest to each position, K at most `_NEAREST`."""
    count = min(_NEAREST, len(places))
    found = np.empty((len(positions), count), np.int32)
    for first in range(0, len(positions), _ROWS):
        distances = np.linalg.norm(positions[first : first + _ROWS, None] - places, axis=2)
        found[first : first + _ROWS] = np.argpartition(distances, count - 1, axis=1)[:, :count]
    return found
