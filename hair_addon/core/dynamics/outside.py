# SPDX-License-Identifier: GPL-3.0-or-later
"""Motion of strands out of meshes: hair between simulated guides, and combed guides.

Simulated guides are outside, but the weighted sums of guides between them may pass through a collider; strokes may push
guides into the surface. From root to tip, each point that is inside is moved to the closest place outside; the
following points move along and return gradually, so that strands keep their shape and almost their length. Strands that
are outside stay bit-identical.

A `Barrier` may remember outside places of points near the surface, and their distances from the surface: a point that
has moved less since then is still outside, and is not searched again. Beyond a rim, a point can move behind the surface
without crossing it, so the motion is also limited to half of the difference between its distances from rim and surface.
"""

from collections.abc import Sequence

import numpy as np
import warp as wp

from ..errors import HairError
from ..kernels import parallel
from ..kernels.parallel import Rows
from .collision.colliders import Colliders
from .collision.distance_grid import DistanceGrid, distance_grid, least_distance
from .collision.free_points import is_free
from .collision.nearest_surface import Surface, nearest
from .simulation import Obstacle

# No gradients are needed. Without fused multiply-add all devices round alike.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

_RETURN = wp.constant(0.15)  # fraction of the way back to the original path, per segment
_ROUNDS = wp.constant(3)  # a point moves out, and back to its distance from the previous point, in each round
_TURNS = wp.constant(8)  # further turns of a segment outwards, where a mesh is concave
_TURN = wp.constant(0.3)  # fraction of a segment's length by which a turn moves the segment's end
_OVERSHOOT = wp.constant(4.0)  # limit of a turn, in missing distances: a point that is almost outside turns little
_PUSHES = wp.constant(4)  # further moves out, for notches of a mesh
_AHEAD = wp.constant(1.0)  # additional search radius in segments, which saves later queries
_FAR = wp.constant(1e6)  # [m]
_PER_CELL = 16  # points for each cell of the grid of distances
_NEAR = wp.constant(1e-6)  # tolerance of distances [m]
_UNKNOWN = -1e6  # for points that were not searched yet
_IS_NON_FINITE = wp.constant(-1)
_RIM_CELLS = 4  # boxes of rims along the longest side of the box around all rims

_NON_FINITE = "Strands to keep outside need points with finite coordinates."


def moved_outside(
    points: np.ndarray, obstacles: Sequence[Obstacle], device: wp.DeviceLike = None
) -> tuple[np.ndarray, np.ndarray]:
    """Return (points (S, P, 3) float64 of strands moved out of obstacles, (S,) bool: whether each strand moved).

    points: (S, P, 3) [m]; obstacles: with the distance that points keep. Roots do not move. Invalid colliders are
    ignored, as in `Colliders`. Raises `HairError` for non-finite points.
    """
    points = np.asarray(points, np.float64)
    origin = points[:, :1].reshape(-1, 3).mean(axis=0) if points.size else np.zeros(3)
    if not np.isfinite(origin).all():
        raise HairError(_NON_FINITE)
    return Barrier(obstacles, origin, points.size // 3, device).moved(points)


class Barrier:
    """Obstacles at rest that strands are moved out of, prepared once for any number of calls."""

    def __init__(
        self, obstacles: Sequence[Obstacle], origin: np.ndarray, point_count: int, device: wp.DeviceLike = None
    ) -> None:
        """obstacles: as for `moved_outside`; origin: (3,) [m] near the strands; point_count: of a typical call."""
        self._origin = np.asarray(origin, np.float64)
        self._colliders = Colliders(wp.get_device(device))
        self._colliders.read([obstacle.seen_from(self._origin) for obstacle in obstacles])
        if self._colliders.mesh is not None:
            self._surface, self._grid = _surface_of(self._colliders), _grid_of(self._colliders, point_count)
            self._rim_boxes = _rim_boxes_of(self._colliders)
        self._known: dict[int, wp.array] = {}  # by point count: (G, P) vec4 for `_keep_outside`

    def moved(
        self, points: np.ndarray, held: np.ndarray | None = None, known_as: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return strands (S, P, 3) [m] moved out of the obstacles, with the results of `moved_outside`.

        held: (S,) number of points from the root that do not move, at least 1; None for the root alone; known_as: (S,)
        unique indices of strands, which identify them in later calls: these take less time for the same result, except
        between close sheets of an open mesh, where the side of the nearest face changes without a crossing.
        Raises `HairError` for non-finite points.
        """
        points = np.asarray(points, np.float64)
        # Each row is a whole strand: broadcasting over three numbers takes three times as long.
        offsets, origin = np.empty(points.shape, np.float32), np.tile(self._origin, points.shape[1])
        np.subtract(points.reshape(len(points), -1), origin, out=offsets.reshape(len(points), -1), casting="same_kind")
        rows, after, is_same = self._moved(offsets, np.eye(3), np.zeros(3), held, known_as)
        is_moved = np.zeros(len(points), bool)
        if not len(rows):
            return points, is_moved
        is_moved[rows] = True
        corrected = points.copy()
        corrected[rows] = np.where(is_same[..., None], points[rows], after)
        return corrected, is_moved

    def moved_local(
        self, points: np.ndarray, axes: np.ndarray, held: np.ndarray | None = None, known_as: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the strands that `moved` moves: (M,) indices, (M, P, 3) float64 points [m], (M, P) bool: which stay.

        points: (S, P, 3) float32 in other coordinates; axes: (3, 3) matrix from these to the obstacles' coordinates.
        The remaining strands cost next to nothing if they are known. Raises `HairError` for non-finite points.
        """
        return self._moved(np.ascontiguousarray(points, np.float32), axes, -self._origin, held, known_as)

    def _moved(self, points, axes, shift, held, known_as):
        """Return as `moved_local`; shift: (3,) [m] from the obstacles' axes to coordinates around the origin."""
        count, point_count = points.shape[:2]
        if self._colliders.mesh is None or not points.size:
            if not np.isfinite(points).all():
                raise HairError(_NON_FINITE)
            return np.zeros(0, int), np.zeros((0, point_count, 3)), np.zeros((0, point_count), bool)
        device = self._colliders.device
        held = np.ones(count, np.int32) if held is None else np.clip(held, 1, point_count).astype(np.int32)
        known = self._known_of(known_as, point_count)
        rows = np.zeros(count, np.int32) if known_as is None else np.asarray(known_as, np.int32)
        inputs = [
            Rows(wp.array(points, dtype=wp.vec3, device=device, copy=False)),
            wp.mat33d(*np.asarray(axes, np.float64).ravel().tolist()),
            wp.vec3d(*map(float, shift)),
            *(Rows(wp.array(numbers, dtype=int, device=device, copy=False)) for numbers in (held, rows)),
            self._surface,
            self._grid,
            *self._rim_boxes,
            known,
        ]
        before, out = (parallel.empty_vectors((count, point_count), device) for _ in range(2))
        found = wp.empty(count, dtype=int, device=device)
        parallel.launch(_keep_outside, count, inputs, [before, out, found], device, least_rows=1024)
        found = found.numpy()
        if found.min() == _IS_NON_FINITE:
            raise HairError(_NON_FINITE)
        moved = np.flatnonzero(found)
        before, after = before.numpy()[moved], out.numpy()[moved]
        return moved, after + self._origin, (after == before).all(axis=2)

    def _known_of(self, known_as, point_count):
        """Return (G, P) vec4 of the last searches of points; empty without `known_as`."""
        if known_as is None:
            return wp.empty((0, 0), dtype=wp.vec4, device=self._colliders.device)
        if known_as.min(initial=0) < 0:
            raise ValueError("Indices of strands must not be negative.")
        count, known = int(known_as.max(initial=-1)) + 1, self._known.get(point_count)
        if known is None or len(known) < count:
            places = np.full((count, point_count, 4), _UNKNOWN, np.float32)
            if known is not None:
                places[: len(known)] = known.numpy()
            known = self._known[point_count] = wp.array(places, dtype=wp.vec4, device=self._colliders.device)
        return known


def _rim_boxes_of(colliders):
    """Return the low and the high corners (B,) vec3 [m] of boxes that contain the faces at rims."""
    at_rims = np.flatnonzero(colliders.rims.numpy())
    corners = colliders.mesh.points.numpy()[colliders.mesh.indices.numpy().reshape(-1, 3)[at_rims]]
    low, high = np.zeros((0, 3), np.float32), np.zeros((0, 3), np.float32)
    if len(at_rims):
        middles = corners.mean(axis=1)
        size = max(float(np.ptp(middles, axis=0).max()) / _RIM_CELLS, 1e-9)
        cells = np.floor((middles - middles.min(axis=0)) / size).astype(np.int64) @ np.array([1, 8, 64])
        order = np.argsort(cells, kind="stable")
        firsts = np.flatnonzero(np.diff(cells[order], prepend=-1))
        low = np.minimum.reduceat(corners[order].min(axis=1), firsts)
        high = np.maximum.reduceat(corners[order].max(axis=1), firsts)
    return [wp.array(corner, dtype=wp.vec3, device=colliders.device) for corner in (low, high)]


def _grid_of(colliders, point_count):
    """Return the grid of distances from the colliders, with a resolution suited to the number of points."""
    mesh = colliders.mesh
    triangles = mesh.indices.numpy().reshape(-1, 3)
    return distance_grid(mesh.points.numpy(), triangles, point_count // _PER_CELL + 1, colliders.device)


def _surface_of(colliders):
    """Return the colliders as a `Surface` for kernels."""
    surface = Surface()
    surface.mesh, surface.points, surface.indices = colliders.mesh.id, colliders.mesh.points, colliders.mesh.indices
    surface.previous, surface.face_colliders = colliders.previous, colliders.face_colliders
    surface.rims, surface.settings = colliders.rims, colliders.settings
    surface.largest_distance = colliders.largest_distance
    return surface


@wp.func
def _lack(surface: Surface, place: wp.vec3, radius: float):
    """Return (outward direction, missing distance of a point, distance of the nearest surface within a radius)."""
    hit = nearest(surface, place, place, radius, 0)
    lack = float(0.0)
    if hit.collider >= 0 and wp.dot(hit.normal, hit.normal) > 0.5:
        lack = surface.settings[hit.collider][1] - hit.distance
    return hit.normal, lack, hit.gap


@wp.func
def _place_of(known: wp.vec4):
    return wp.vec3(known[0], known[1], known[2])


@wp.func
def _known_at(place: wp.vec3, free: float, gap: float, low: wp.array[wp.vec3], high: wp.array[wp.vec3]):
    """Return a place and the distance [m] that a point may move from there, `free` or less near rims."""
    rim = float(_FAR)
    for box in range(low.shape[0]):
        rim = wp.min(rim, wp.length(place - wp.min(wp.max(place, low[box]), high[box])))
    free = wp.min(free, 0.5 * (rim - gap))
    return wp.vec4(place[0], place[1], place[2], free)


@wp.kernel
def _keep_outside(
    points: wp.array2d[wp.vec3],
    axes: wp.mat33d,
    shift: wp.vec3d,
    first_moved: wp.array[int],
    rows: wp.array[int],
    surface: Surface,
    grid: DistanceGrid,
    rim_low: wp.array[wp.vec3],
    rim_high: wp.array[wp.vec3],
    known: wp.array2d[wp.vec4],  # of rows: a place where each point was outside, and how far it may move from there
    # outputs, of which points are only of moved strands
    out_before: wp.array2d[wp.vec3],
    out_points: wp.array2d[wp.vec3],
    out_moved: wp.array[int],
):
    strand = wp.tid()
    row = rows[strand]
    out_moved[strand] = 0
    if known.shape[0] > 0:
        if is_free(strand, row, first_moved[strand], points, axes, shift, grid, surface.largest_distance, known) == 1:
            return
    for i in range(points.shape[1]):
        place = wp.vec3(axes * wp.vec3d(points[strand, i]) + shift)
        if not wp.isfinite(place):
            out_moved[strand] = _IS_NON_FINITE
            return
        out_before[strand, i] = place
    last = out_before[strand, 0]
    out_points[strand, 0] = last
    is_moved = int(0)
    is_sure = int(0)  # whether the last point is outside; unknown behind points that do not move, or are stuck inside
    clear = float(0.0)  # distance that can be traveled before a surface may be near
    for i in range(1, first_moved[strand]):
        last = out_before[strand, i]
        out_points[strand, i] = last
    for i in range(first_moved[strand], points.shape[1]):
        before = out_before[strand, i - 1]
        last_but_one = out_points[strand, wp.max(i - 2, 0)]
        way = out_before[strand, i] - before
        size = wp.length(way)
        place = out_before[strand, i]
        if is_moved == 1:
            place = last + size * wp.normalize(way + _RETURN * (before - last))
        step_size = wp.length(place - last)
        clear -= step_size
        if clear <= 0.0:
            clear = least_distance(grid, place) - surface.largest_distance
            if clear > step_size:  # outside like the previous point: no surface between the two
                out_points[strand, i] = place
                last = place
                continue
            if known.shape[0] > 0:
                clear = known[row, i][3] - wp.length(place - _place_of(known[row, i]))
                if clear > 0.0:
                    is_sure = 1
                    out_points[strand, i] = place
                    last = place
                    continue
            lack = float(1.0)
            gap = float(0.0)
            # The previous point is outside: a surface between the two is no farther than their distance.
            radius = _AHEAD * size + step_size + surface.largest_distance
            if i == first_moved[strand]:  # points that do not move may be inside
                radius = _FAR
            for step in range(_ROUNDS + _TURNS + 1 + _PUSHES):
                if lack > _NEAR:
                    out, lack, gap = _lack(surface, place, radius)
                    if lack > _NEAR:
                        is_moved = 1
                        if step < _ROUNDS or step > _ROUNDS + _TURNS:
                            place += lack * out
                        elif step < _ROUNDS + _TURNS:
                            place += wp.min(_TURN * size, _OVERSHOOT * lack) * out
                        else:  # the notch is narrower than the segment, which turns back
                            place = last_but_one
                        if step <= _ROUNDS + _TURNS:
                            place = last + size * wp.normalize(place - last)
            clear = gap - surface.largest_distance
            if lack > _NEAR:
                is_sure = 0
            elif gap < radius:  # otherwise outside only if the last point is
                is_sure = 1
            if known.shape[0] > 0 and is_sure == 1:
                known[row, i] = _known_at(place, clear, gap, rim_low, rim_high)
        out_points[strand, i] = place
        last = place
    out_moved[strand] = is_moved
