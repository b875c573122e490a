# SPDX-License-Identifier: GPL-3.0-or-later
"""Flow lines: polylines on a surface that determine the initial direction of guides.

The direction at a root is a mean of the lines' directions with the weights of Eq. 9 [Report12], with the distance to
the nearest line as sigma. On a line, guides follow the line. Between lines, the direction is continuous. Where lines
oppose each other, and far from all lines, guides follow the surface normal. The reach of a line depends on the spacing
of lines.
"""

from dataclasses import dataclass

import numpy as np
import warp as wp
from numpy.typing import ArrayLike

from ..errors import HairError
from ..geometry import closest_point
from ..geometry.mesh import TriMesh, positions
from ..interpolation import part_lines

_PIECES = 64  # resolution of lines: pieces per square root of the surface's area
_DECIDED = 0.5  # length of the mean direction (1 where lines agree) above which guides turn completely
_ROOM = 1 << 20  # distances in a batch


@dataclass(frozen=True)
class FlowLines:
    """Pieces of lines on a surface.

    starts, ends: (N, 3) float64 [m]; reaches: (N,) [m], distance of full effect, which fades to zero at twice the
    distance; step: length [m] of the longest pieces.
    """

    starts: np.ndarray
    ends: np.ndarray
    reaches: np.ndarray
    step: float


def lay(
    mesh: TriMesh, segments: ArrayLike, device: wp.DeviceLike = "cpu", drawn_on: np.ndarray | None = None
) -> FlowLines:
    """Return the `FlowLines` of segments (L, 2, 3) [m] on a checked mesh; consecutive segments that touch form a line.

    drawn_on: (V, 3) vertices of the posed surface on which the segments were drawn, None for the mesh's own. Raises
    `HairError`.
    """
    segments = np.asarray(segments, np.float64)
    if segments.ndim != 3 or segments.shape[1:] != (2, 3) or not len(segments):
        raise HairError("The flow lines have no segments: draw a line of at least two points.")
    if not np.isfinite(segments).all():
        raise HairError("Some points of the flow lines have non-finite coordinates: delete those lines.")
    step = float(np.sqrt(mesh.areas.sum())) / _PIECES
    surface = mesh if drawn_on is None else TriMesh(drawn_on, mesh.triangles)
    query = closest_point.SurfaceQuery(surface, device=device)
    lines = []
    for drawn in part_lines.chained(segments):
        line = positions(mesh, query.nearest(part_lines.divided(drawn, step))).astype(np.float64)
        pieces = np.stack([line[:-1], line[1:]])
        pieces = pieces[:, np.linalg.norm(pieces[1] - pieces[0], axis=1) > 1e-6 * step]
        if pieces.shape[1]:
            lines.append(pieces)
    if not lines:
        raise HairError("The flow lines have no length: draw a line of at least two points.")
    starts, ends = np.concatenate(lines, axis=1)
    counts = [pieces.shape[1] for pieces in lines]
    return FlowLines(starts, ends, np.repeat(_reaches(lines, step), counts), step)


def axes(lines: FlowLines, places: np.ndarray, normals: np.ndarray, lift: float | np.ndarray) -> np.ndarray:
    """Return the initial unit directions (G, 3) of guides at roots (G, 3) [m] with unit normals (G, 3).

    lift: angle [rad] to the surface near lines, in [0, π/2], possibly (G,); far from lines guides start along their
    normals.
    """
    normals = normals.astype(np.float64)
    mean, share = _mean_directions(lines, places.astype(np.float64))
    across = mean - np.einsum("gi,gi->g", mean, normals)[:, None] * normals
    size = np.linalg.norm(across, axis=1)
    flow = across / np.maximum(size, 1e-12)[:, None]
    turned = share * _smoothstep(size / _DECIDED) * (0.5 * np.pi - lift)
    return np.cos(turned)[:, None] * normals + np.sin(turned)[:, None] * flow


def _mean_directions(lines, places):
    """Return ((G, 3) weighted means of unit directions, (G,) influence of the lines on each guide, in [0, 1])."""
    along = lines.ends - lines.starts  # unit directions weighted by length
    lengths = np.linalg.norm(along, axis=1)
    mean, share = np.empty((len(places), 3)), np.empty(len(places))
    for rows in _blocks(len(places), len(lengths)):
        distances = _distances(places[rows], lines.starts, lines.ends)
        nearest = distances.min(axis=1)
        sigma = np.maximum(nearest, lines.step)
        weights = np.exp(-0.5 * (distances / sigma[:, None]) ** 2)  # Eq. 9
        total = weights @ lengths
        mean[rows] = (weights @ along) / total[:, None]
        reach = (weights @ (lengths * lines.reaches)) / total
        share[rows] = 1.0 - _smoothstep(nearest / reach - 1.0)
    return mean, share


def _reaches(lines, step):
    """Return the reach (L,) [m] of each line: its largest distance to other lines, at most its own length."""
    reaches = []
    for number, (starts, ends) in enumerate(lines):
        reach = np.linalg.norm(ends - starts, axis=1).sum()
        others = lines[:number] + lines[number + 1 :]
        if others:
            pieces = np.concatenate(others, axis=1)
            nearest = [_distances(starts[rows], *pieces).min(axis=1) for rows in _blocks(len(starts), pieces.shape[1])]
            reach = min(reach, max(part.max() for part in nearest))
        reaches.append(max(reach, 2.0 * step))
    return np.array(reaches)


def _distances(places, starts, ends):
    """Return distances (G, N) from places (G, 3) to segments."""
    along = ends - starts
    squared = np.einsum("ni,ni->n", along, along)
    center = starts.mean(axis=0)  # preserves precision far from the origin
    places, starts = places - center, starts - center
    progress = places @ along.T - np.einsum("ni,ni->n", starts, along)
    part = np.clip(progress / squared, 0.0, 1.0)
    to_starts = np.einsum("gi,gi->g", places, places)[:, None] - 2.0 * places @ starts.T
    to_starts += np.einsum("ni,ni->n", starts, starts)
    # |x - s - part a|², without an array of vectors
    return np.sqrt(np.maximum(to_starts + part * (part * squared - 2.0 * progress), 0.0))


def _blocks(row_count, column_count):
    """Return slices of rows that limit the memory of a table with a number of columns."""
    size = max(_ROOM // column_count, 1)
    return [slice(first, first + size) for first in range(0, row_count, size)]


def _smoothstep(x):
    x = np.clip(x, 0.0, 1.0)
    return x * x * (3.0 - 2.0 * x)
