# SPDX-License-Identifier: GPL-3.0-or-later
"""Part lines: polylines on a surface that paths from a strand's root to a guide's root do not cross.

If the straight path crosses a line, the path goes around one of its ends. A closed path around a part of the line is no
shorter than the triangle of root, guide and any point v of that part, so with the line cut into pieces by the crossings

    length = min over {odd pieces, even pieces} of max over their points v of |q - v| + |v - g|

which is exact for straight lines, and continuous unless the root passes through the line: where the straight path
touches an end or a bend v, the last piece is only the point v on the path. So the separation decreases toward the end
of a line. No path leads around an end at the surface's border or at another line.
"""

from dataclasses import dataclass

import numpy as np
import warp as wp
from numpy.typing import ArrayLike

from ..errors import HairError
from ..geometry import closest_point
from ..geometry.mesh import TriMesh, positions
from ..kernels import kernel_cache
from ..kernels.checks import require_count, require_indices

# No gradients are needed. Without fused multiply-add all devices round alike.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

PIECES = 64  # pieces of a line per longest side of the surface, when it is laid on the surface

CLOSED, BLOCKED_START, BLOCKED_END = 1, 2, 4


@dataclass(frozen=True)
class PartLines:
    """Lines on a surface, on a device: points (N,) vec3 [m], concatenated.

    starts (L+1,) int32: offset of each line; ends (L,) int32: CLOSED, BLOCKED_START, BLOCKED_END or their sum, for ends
    that no path leads around.
    """

    points: "wp.array[wp.vec3]"
    starts: "wp.array[int]"
    ends: "wp.array[int]"


def lay(
    mesh: TriMesh, segments: ArrayLike, device: wp.DeviceLike = "cpu", drawn_on: np.ndarray | None = None
) -> PartLines:
    """Return the `PartLines` of segments (L, 2, 3) [m] laid on a checked mesh; consecutive segments form a line.

    drawn_on: vertices (V, 3) of the posed surface that the lines were drawn on, if they differ from the mesh's.
    """
    segments = np.asarray(segments, np.float64)
    if segments.ndim != 3 or segments.shape[1:] != (2, 3) or not len(segments):
        raise HairError("The part lines have no segments: draw a line of at least two points.")
    if not np.isfinite(segments).all():
        raise HairError("Some points of the part lines have non-finite coordinates: delete those lines.")
    lines, step = _on_mesh(mesh, segments, drawn_on, device)
    borders = _border_segments(mesh)
    laid, kinds = [], []
    for number, line in enumerate(lines):
        if len(line) > 2 and np.array_equal(line[0], line[-1]):
            laid.append(line)
            kinds.append(CLOSED)
            continue
        walls = np.concatenate([borders, *(_pairs(other) for other in lines[:number] + lines[number + 1 :])])
        kind = 0
        for blocked in (BLOCKED_START, BLOCKED_END):
            end = line[0] if blocked == BLOCKED_START else line[-1]
            wall = _nearest_on(walls, end)
            if wall is not None and np.linalg.norm(wall - end) <= step:
                line = np.concatenate([wall[None], line] if blocked == BLOCKED_START else [line, wall[None]])
                kind += blocked
        laid.append(line)
        kinds.append(kind)
    starts = np.cumsum([0, *map(len, laid)])
    return PartLines(
        wp.array(np.concatenate(laid).astype(np.float32), dtype=wp.vec3, device=device),
        wp.array(starts, dtype=int, device=device),
        wp.array(kinds, dtype=int, device=device),
    )


def at_rest(mesh: TriMesh, segments: np.ndarray, drawn_on: np.ndarray, device: wp.DeviceLike = "cpu") -> np.ndarray:
    """Return (M, 2, 3) float64 segments [m] on a checked mesh, for segments drawn near posed vertices (V, 3)."""
    if not np.isfinite(segments).all():
        return segments  # `lay` raises the error
    lines, _step = _on_mesh(mesh, segments, drawn_on, device)
    return np.concatenate([_pairs(line) for line in lines])


def _on_mesh(mesh, segments, drawn_on, device):
    """Return [(N, 3) float64 polylines] on a mesh, from lines near it or near `drawn_on`, and their step [m]."""
    surface = mesh if drawn_on is None else TriMesh(drawn_on, mesh.triangles)
    step = np.ptp(mesh.vertices.astype(np.float64), axis=0).max() / PIECES
    query = closest_point.SurfaceQuery(surface, device=device)
    lines = [positions(mesh, query.nearest(divided(line, step))).astype(np.float64) for line in chained(segments)]
    return lines, step


def in_order(edges: ArrayLike) -> np.ndarray:
    """Return edges (L, 2), indices of points, in an order in which each starts at the previous end if possible.

    Lines end where only one edge ends, or more than two meet; rings start at their first edge.
    """
    pairs = [tuple(edge) for edge in np.asarray(edges).tolist()]
    at = {}
    for number, edge in enumerate(pairs):
        for point in edge:
            at.setdefault(point, []).append(number)
    left, walked = dict.fromkeys(range(len(pairs))), []

    def walk(point, number):
        while number is not None:
            del left[number]
            first, second = pairs[number]
            before, point = point, second if point == first else first
            walked.append((before, point))
            number = next((other for other in at[point] if other in left), None) if len(at[point]) == 2 else None

    for point, numbers in at.items():
        if len(numbers) != 2:
            for number in numbers:
                if number in left:
                    walk(point, number)
    for number in range(len(pairs)):
        if number in left:
            walk(pairs[number][0], number)
    return np.array(walked, np.int64).reshape(-1, 2)


def chained(segments: np.ndarray) -> list[np.ndarray]:
    """Return [(N, 3) polylines]: segments (L, 2, 3) that start at the end of the previous one are joined."""
    breaks = np.flatnonzero((segments[1:, 0] != segments[:-1, 1]).any(axis=1)) + 1
    return [np.concatenate([part[:1, 0], part[:, 1]]) for part in np.split(segments, breaks)]


def divided(line: np.ndarray, step: float) -> np.ndarray:
    """Return a polyline (N, 3) resampled to (M, 3): points at most one step and at least a quarter step apart."""
    along = np.cumsum(np.concatenate([[0.0], np.linalg.norm(np.diff(line, axis=0), axis=1)]))
    is_kept = np.diff(np.floor(along / (0.25 * step)), prepend=-1.0) > 0.0
    is_kept[-1] = True
    line = line[is_kept]
    counts = np.clip(np.ceil(np.linalg.norm(np.diff(line, axis=0), axis=1) / step), 1, 16 * PIECES).astype(int)
    along = np.concatenate([i + np.arange(count) / count for i, count in enumerate(counts)] + [[len(counts)]])
    return np.stack([np.interp(along, np.arange(len(line)), line[:, axis]) for axis in range(3)], axis=1)


def _pairs(line):
    return np.stack([line[:-1], line[1:]], axis=1)


def _border_segments(mesh):
    """Return (B, 2, 3) float64: edges of only one triangle; coincident vertices count as one vertex."""
    _places, same = np.unique(mesh.vertices, axis=0, return_inverse=True)
    triangles = same.reshape(-1)[mesh.triangles]
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    _edges, first, counts = np.unique(edges, axis=0, return_index=True, return_counts=True)
    lonely = first[counts == 1]
    corners = mesh.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)[lonely]
    return mesh.vertices.astype(np.float64)[corners]


def _nearest_on(segments, place):
    """Return (3,): the point of segments (B, 2, 3) that is nearest to a position, None without segments."""
    if not len(segments):
        return None
    start, edge = segments[:, 0], segments[:, 1] - segments[:, 0]
    squared = np.einsum("bi,bi->b", edge, edge)
    part = np.clip(np.einsum("bi,bi->b", place - start, edge) / np.where(squared > 0.0, squared, 1.0), 0.0, 1.0)
    nearest = start + part[:, None] * edge
    return nearest[np.linalg.norm(nearest - place, axis=1).argmin()]


def near(lines: PartLines, roots: wp.array[wp.vec3], ways: wp.array2d[float]) -> np.ndarray:
    """Return (N,) int32: roots (S,) [m] whose distance to a line is below the length of their last path (S, K) [m]."""
    require_count("distances", len(ways), len(roots))
    is_near = wp.empty(len(roots), dtype=bool, device=roots.device)
    kernel_cache.launch(
        _near, len(roots), [roots, ways, lines.points, lines.starts], outputs=[is_near], device=roots.device
    )
    return np.flatnonzero(is_near.numpy()).astype(np.int32)


def go_around(
    lines: PartLines,
    roots: wp.array[wp.vec3],
    normals: wp.array[wp.vec3],
    guide_roots: wp.array[wp.vec3],
    guide_normals: wp.array[wp.vec3],
    candidates: wp.array2d[int],
    ways: wp.array2d[float],
) -> None:
    """Lengthen paths (S, K) [m] from roots to candidate guides (S, K) around lines between them, and sort both.

    A guide behind a line without open ends is infinitely far away; if all guides are, the nearest is unchanged.
    """
    require_count("normals", len(normals), len(roots))
    require_count("guide normals", len(guide_normals), len(guide_roots))
    require_count("candidates", candidates.size, ways.size)
    require_count("candidates", len(candidates), len(roots))
    require_indices("guides", np.maximum(candidates.numpy(), 0), len(guide_roots))
    kernel_cache.launch(
        _go_round,
        dim=len(roots),
        inputs=[roots, normals, guide_roots, guide_normals, lines.points, lines.starts, lines.ends],
        outputs=[candidates, ways],
        device=roots.device,
    )


@wp.func
def _distance_to_segment(place: wp.vec3, start: wp.vec3, end: wp.vec3):
    edge = end - start
    part = wp.clamp(wp.dot(place - start, edge) / wp.max(wp.dot(edge, edge), 1.0e-30), 0.0, 1.0)
    return wp.length(place - start - part * edge)


@wp.func
def _crosses(root: wp.vec3, guide: wp.vec3, up: wp.vec3, start: wp.vec3, end: wp.vec3):
    """Whether two segments cross as seen from above, with a difference in height of at most the length of the path."""
    way = guide - root
    edge = end - start
    start_side = wp.dot(wp.cross(way, start - root), up)
    end_side = wp.dot(wp.cross(way, end - root), up)
    root_side = wp.dot(wp.cross(edge, root - start), up)
    guide_side = wp.dot(wp.cross(edge, guide - start), up)
    # A point on the other segment counts to one of its sides, so a path past a bend crosses one of its edges, or both.
    if (start_side > 0.0) == (end_side > 0.0) or (root_side > 0.0) == (guide_side > 0.0):
        return False
    on_edge = start + start_side / (start_side - end_side) * edge
    on_way = root + root_side / (root_side - guide_side) * way
    return wp.abs(wp.dot(on_edge - on_way, up)) <= wp.length(way)


@wp.func
def _path_around(
    root: wp.vec3,
    guide: wp.vec3,
    up: wp.vec3,
    points: wp.array[wp.vec3],
    start: int,
    end: int,
    ends: int,
    first: int,
    last: int,
):
    """Length of the path around one line, whose points from `first` to `last` are near; 0 if it is not crossed."""
    is_between = bool(False)
    for point in range(first, last):
        is_between = is_between or _crosses(root, guide, up, points[point], points[point + 1])
    if not is_between:
        return float(0.0)
    even = float(0.0)
    odd = float(0.0)
    if ends & BLOCKED_START:
        even = wp.inf
    is_odd = bool(False)
    for point in range(start, end):
        around = wp.length(points[point] - root) + wp.length(points[point] - guide)
        if is_odd:
            odd = wp.max(odd, around)
        else:
            even = wp.max(even, around)
        if point >= first and point < last and _crosses(root, guide, up, points[point], points[point + 1]):
            is_odd = not is_odd
    if ends & CLOSED and is_odd:  # one is inside
        return wp.inf
    if ends & BLOCKED_END:
        if is_odd:
            odd = wp.inf
        else:
            even = wp.inf
    return wp.min(even, odd)


@wp.kernel
def _near(
    roots: wp.array[wp.vec3],
    ways: wp.array2d[float],
    points: wp.array[wp.vec3],
    starts: wp.array[int],
    # outputs
    out_is_near: wp.array[bool],
):
    strand = wp.tid()
    root = roots[strand]
    farthest = ways[strand, ways.shape[1] - 1]
    is_near = bool(False)
    for line in range(starts.shape[0] - 1):
        point = starts[line]
        while point < starts[line + 1] - 1 and not is_near:
            is_near = _distance_to_segment(root, points[point], points[point + 1]) <= farthest
            point += 1
    out_is_near[strand] = is_near


@wp.kernel
def _go_round(
    roots: wp.array[wp.vec3],
    normals: wp.array[wp.vec3],
    guide_roots: wp.array[wp.vec3],
    guide_normals: wp.array[wp.vec3],
    points: wp.array[wp.vec3],
    starts: wp.array[int],
    ends: wp.array[int],
    # outputs
    out_candidates: wp.array2d[int],
    out_ways: wp.array2d[float],
):
    strand = wp.tid()
    candidates = out_candidates[strand]
    ways = out_ways[strand]
    root = roots[strand]
    count = int(0)
    while count < candidates.shape[0] and candidates[count] >= 0:
        count += 1
    farthest = ways[count - 1]
    nearest_guide = candidates[0]
    nearest = ways[0]
    for line in range(ends.shape[0]):
        first = int(-1)
        last = int(-1)
        for point in range(starts[line], starts[line + 1] - 1):
            if _distance_to_segment(root, points[point], points[point + 1]) <= farthest:
                if first < 0:
                    first = point
                last = point + 1
        if first >= 0:
            for slot in range(count):
                guide = candidates[slot]
                up = wp.normalize(normals[strand] + guide_normals[guide])
                around = _path_around(
                    root, guide_roots[guide], up, points, starts[line], starts[line + 1], ends[line], first, last
                )
                ways[slot] = wp.max(ways[slot], around)
    for slot in range(1, count):  # insertion sort: they are mostly in order
        way = ways[slot]
        guide = candidates[slot]
        place = int(slot)
        while place > 0 and ways[place - 1] > way:
            ways[place] = ways[place - 1]
            candidates[place] = candidates[place - 1]
            place -= 1
        ways[place] = way
        candidates[place] = guide
    if ways[0] == wp.inf:
        # Stable order: the nearest one is still the first.
        candidates[0] = nearest_guide
        ways[0] = nearest
