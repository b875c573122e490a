# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands between simulated guides, kept out of what the guides collide with.

Guides are outside, yet a mean of them may pass through a collider between them. From root to tip, each point that is
inside is moved to the nearest place outside, and what follows it is taken along and returns gradually, so that strands
keep their shape and nearly their length. Strands that are outside stay bit by bit.
"""

from collections.abc import Sequence

import numpy as np
import warp as wp

from ..errors import HairError
from ..kernels import parallel
from ..kernels.parallel import Rows
from .collision.colliders import Colliders
from .collision.distance_grid import DistanceGrid, distance_grid, least_distance
from .collision.nearest_surface import Surface, nearest
from .simulation import Obstacle

# No gradients are needed. Without fused multiply-add all devices round alike.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

_RETURN = wp.constant(0.15)  # of the way back, that a strand takes on the length of a segment
_ROUNDS = wp.constant(3)  # of moving a point out, and back to its distance from the one before
_PUSHES = wp.constant(4)  # afterwards, where one is not enough: in the notches of a mesh
_AHEAD = wp.constant(1.0)  # segments that a surface is looked for beyond the next point, to spare later queries
_PER_CELL = 16  # points for each cell of the grid of distances
_NEAR = wp.constant(1e-6)  # [m] less than the distance that counts as that distance


def kept_outside(
    points: np.ndarray, obstacles: Sequence[Obstacle], device: wp.DeviceLike = None
) -> tuple[np.ndarray, np.ndarray]:
    """Strands (S, P, 3) [m] → (the same kept outside, float64; (S,) bool, which of them had to be moved).

    obstacles: each with the distance that points keep. Roots stay. A collider that cannot be used is ignored, as
    `Colliders` does. Raises `HairError` for points that are not finite.
    """
    points = np.asarray(points, np.float64)
    if not np.isfinite(points).all():
        raise HairError("Strands to keep outside need points with finite coordinates.")
    colliders = Colliders(wp.get_device(device))
    origin = points[:, :1].reshape(-1, 3).mean(axis=0) if points.size else np.zeros(3)
    colliders.read([obstacle.seen_from(origin) for obstacle in obstacles])
    is_moved = np.zeros(len(points), bool)
    if colliders.mesh is None or not points.size:
        return points, is_moved
    # In rows as long as strands: three numbers at a time take thrice as long.
    offsets = points.reshape(len(points), -1) - np.tile(origin, points.shape[1])
    given = wp.array(offsets.astype(np.float32).reshape(points.shape), dtype=wp.vec3, device=colliders.device)
    out = wp.empty_like(given)
    moved = wp.zeros(len(points), dtype=int, device=colliders.device)
    inputs = [Rows(given), _surface_of(colliders), _grid_of(colliders, points.size // 3)]
    parallel.launch(_keep_outside, len(points), inputs, [out, moved], colliders.device, least_rows=256)
    is_moved = moved.numpy() != 0
    if not is_moved.any():
        return points, is_moved
    before, after = given.numpy()[is_moved], out.numpy()[is_moved]
    is_same = (after == before).all(axis=2)[..., None]
    kept = points.copy()
    kept[is_moved] = np.where(is_same, points[is_moved], after + origin)
    return kept, is_moved


def _grid_of(colliders, point_count):
    """Distances from the colliders, on a grid that is worth its time for so many points."""
    mesh = colliders.mesh
    triangles = mesh.indices.numpy().reshape(-1, 3)
    return distance_grid(mesh.points.numpy(), triangles, point_count // _PER_CELL + 1, colliders.device)


def _surface_of(colliders):
    """The colliders as points ask them."""
    surface = Surface()
    surface.mesh, surface.points, surface.indices = colliders.mesh.id, colliders.mesh.points, colliders.mesh.indices
    surface.previous, surface.face_colliders = colliders.previous, colliders.face_colliders
    surface.rims, surface.settings = colliders.rims, colliders.settings
    surface.largest_distance = colliders.largest_distance
    return surface


@wp.func
def _lack(surface: Surface, place: wp.vec3, radius: float):
    """(direction out, how far a point lacks its distance, how far the nearest surface is, up to a radius)."""
    hit = nearest(surface, place, place, radius, 0)
    lack = float(0.0)
    if hit.collider >= 0 and wp.dot(hit.normal, hit.normal) > 0.5:
        lack = surface.settings[hit.collider][1] - hit.distance
    return hit.normal, lack, hit.gap


@wp.kernel
def _keep_outside(
    points: wp.array2d[wp.vec3],
    surface: Surface,
    grid: DistanceGrid,
    # outputs
    out_points: wp.array2d[wp.vec3],
    out_moved: wp.array[int],
):
    strand = wp.tid()
    last = points[strand, 0]
    out_points[strand, 0] = last
    is_moved = int(0)
    clear = float(0.0)  # way that may be gone before a surface can be near
    for i in range(1, points.shape[1]):
        before = points[strand, i - 1]
        way = points[strand, i] - before
        size = wp.length(way)
        place = points[strand, i]
        if is_moved == 1:
            place = last + size * wp.normalize(way + _RETURN * (before - last))
        step_size = wp.length(place - last)
        clear -= step_size
        if clear <= 0.0:
            clear = least_distance(grid, place) - surface.largest_distance
            if clear > step_size:  # outside, as the point before: there is no surface between the two
                out_points[strand, i] = place
                last = place
                continue
            lack = float(1.0)
            gap = float(0.0)
            # The point before is outside, so a surface between the two is not farther than they are apart.
            radius = _AHEAD * size + step_size + surface.largest_distance
            for step in range(_ROUNDS + _PUSHES):
                if lack > _NEAR:
                    out, lack, gap = _lack(surface, place, radius)
                    if lack > _NEAR:
                        is_moved = 1
                        place += lack * out
                        if step < _ROUNDS:
                            place = last + size * wp.normalize(place - last)
            clear = gap - surface.largest_distance
        out_points[strand, i] = place
        last = place
    out_moved[strand] = is_moved
