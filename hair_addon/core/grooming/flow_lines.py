# SPDX-License-Identifier: GPL-3.0-or-later
"""Flow lines: polylines on a surface that determine the initial direction of guides.

The direction at a root is a mean of the lines' directions with the weights of Eq. 9 [Report12], with the distance to
the nearest line as sigma. On a line, guides follow the line. Between lines, the direction is continuous. Where lines
oppose each other, and far from all lines, guides follow the surface normal. The reach of a line depends on the spacing
of lines.

Part lines divide the flow as they divide strands: the distance to a flow line behind a part line is the length of the
path around its end. A path that is longer than the straight one by half of the distance to the nearest line has no
weight, so guides follow lines of their own side up to the part line, and the separation fades toward its end.
"""

from dataclasses import dataclass

import numpy as np
import warp as wp
from numpy.typing import ArrayLike

from ..errors import HairError
from ..geometry import closest_point
from ..geometry.mesh import TriMesh, normals, positions
from ..interpolation import part_lines
from ..interpolation.part_lines import PartLines

_PIECES = 64  # resolution of lines: pieces per square root of the surface's area
_DECIDED = 0.5  # length of the mean direction (1 where lines agree) above which guides turn completely
_DETOUR = 0.5  # detour around a part line that has no weight, relative to the distance to the nearest line
_FEW = 0.25  # part of the weight that part lines must leave to flow lines; with less, their effect fades
_ROOM = 1 << 20  # distances in a batch


@dataclass(frozen=True)
class FlowLines:
    """Pieces of lines on a surface.

    starts, ends: (N, 3) float64 [m]; reaches: (N,) [m], distance of full effect, which fades to zero at twice the
    distance; step: length [m] of the longest pieces; normals: (N, 3) of the surface at the pieces; parting: part lines
    between pieces and guides, or None.
    """

    starts: np.ndarray
    ends: np.ndarray
    reaches: np.ndarray
    step: float
    normals: np.ndarray
    parting: PartLines | None = None


def lay(
    mesh: TriMesh,
    segments: ArrayLike,
    device: wp.DeviceLike = "cpu",
    drawn_on: np.ndarray | None = None,
    parting: PartLines | None = None,
) -> FlowLines:
    """Return the `FlowLines` of segments (L, 2, 3) [m] on a checked mesh; consecutive segments that touch form a line.

    drawn_on: (V, 3) vertices of the posed surface on which the segments were drawn, None for the mesh's own; parting:
    part lines that are laid on the mesh, or None. Raises `HairError`.
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
        places = query.nearest(part_lines.divided(drawn, step))
        line, upward = positions(mesh, places).astype(np.float64), normals(mesh, places).astype(np.float64)
        pieces = np.stack([line[:-1], line[1:], upward[:-1]])
        pieces = pieces[:, np.linalg.norm(pieces[1] - pieces[0], axis=1) > 1e-6 * step]
        if pieces.shape[1]:
            lines.append(pieces)
    if not lines:
        raise HairError("The flow lines have no length: draw a line of at least two points.")
    starts, ends, upward = np.concatenate(lines, axis=1)
    counts = [pieces.shape[1] for pieces in lines]
    reaches = _reaches([pieces[:2] for pieces in lines], step)
    return FlowLines(starts, ends, np.repeat(reaches, counts), step, upward, parting)


def axes(lines: FlowLines, places: np.ndarray, root_normals: np.ndarray, lift: float | np.ndarray) -> np.ndarray:
    """Return the initial unit directions (G, 3) of guides at roots (G, 3) [m] with unit normals (G, 3).

    lift: angle [rad] to the surface near lines, in [0, π/2], possibly (G,); far from lines guides start along their
    normals.
    """
    upward = root_normals.astype(np.float64)
    mean, share = _mean_directions(lines, places.astype(np.float64), upward)
    across = mean - np.einsum("gi,gi->g", mean, upward)[:, None] * upward
    size = np.linalg.norm(across, axis=1)
    flow = across / np.maximum(size, 1e-12)[:, None]
    turned = share * _smoothstep(size / _DECIDED) * (0.5 * np.pi - lift)
    return np.cos(turned)[:, None] * upward + np.sin(turned)[:, None] * flow


def _mean_directions(lines, places, upward):
    """Return ((G, 3) weighted means of unit directions, (G,) influence of the lines on each guide, in [0, 1])."""
    along = lines.ends - lines.starts  # unit directions weighted by length
    lengths = np.linalg.norm(along, axis=1)
    mean, share = np.empty((len(places), 3)), np.empty(len(places))
    for rows in _blocks(len(places), len(lengths)):
        distances = _distances(places[rows], lines.starts, lines.ends)
        detours = 0.0 if lines.parting is None else _detours(lines, places[rows], upward[rows])
        distances = distances + detours
        nearest = distances.min(axis=1)
        is_met = np.isfinite(nearest)  # without a path to any line, lines have no effect
        sigma = np.where(is_met, np.maximum(nearest, lines.step), 1.0)
        weights = np.exp(-0.5 * (distances / sigma[:, None]) ** 2)  # Eq. 9
        everything = weights @ lengths
        weights *= 1.0 - _smoothstep(detours / (_DETOUR * sigma[:, None]))
        total = weights @ lengths
        is_met &= total > 0.0
        own = np.divide(total, everything, out=np.zeros_like(total), where=is_met)
        total = np.where(is_met, total, 1.0)
        mean[rows] = (weights @ along) / total[:, None]
        reach = np.where(is_met, (weights @ (lengths * lines.reaches)) / total, 1.0)
        share[rows] = _smoothstep(own / _FEW) * (1.0 - _smoothstep(nearest / reach - 1.0))
    return mean, share


def _detours(lines, places, upward):
    """Return (G, N) [m]: how much part lines lengthen the paths from places (G, 3) with normals to pieces.

    Infinite without a path.
    """
    parting, middles = lines.parting, 0.5 * (lines.starts + lines.ends)
    device = parting.points.device
    straight = np.linalg.norm(places[:, None] - middles, axis=2).astype(np.float32)
    order = np.argsort(straight, axis=1, kind="stable")
    # Without any path, `go_around` does not change the first candidate, so this candidate is repeated.
    order = np.concatenate([order[:, :1], order], axis=1).astype(np.int32)
    found, ways = wp.array(order, device=device), wp.array(np.take_along_axis(straight, order, axis=1), device=device)
    roots, root_normals, there, facing = (
        wp.array(each.astype(np.float32), dtype=wp.vec3, device=device)
        for each in (places, upward, middles, lines.normals)
    )
    part_lines.go_around(parting, roots, root_normals, there, facing, found, ways)
    around = np.empty_like(straight)
    np.put_along_axis(around, found.numpy(), ways.numpy(), axis=1)
    around[np.isinf(ways.numpy()[:, 1])] = np.inf
    return around.astype(np.float64) - straight


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
