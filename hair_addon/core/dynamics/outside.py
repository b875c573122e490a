# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands between simulated guides, kept outside the guides' colliders.

Guides are outside, but their weighted sums may pass through a collider between them. From root to tip, each point that
is inside is moved to the closest place outside; the following points move along and return gradually, so that strands
keep their shape and almost their length. Strands that are outside stay bit-identical.
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

_RETURN = wp.constant(0.15)  # fraction of the way back to the original path, per segment
_ROUNDS = wp.constant(3)  # of moving a point out, and back to its distance from the previous point
_PUSHES = wp.constant(4)  # further moves out, for notches of a mesh
_AHEAD = wp.constant(1.0)  # additional search radius in segments, which saves later queries
_PER_CELL = 16  # points for each cell of the grid of distances
_NEAR = wp.constant(1e-6)  # tolerance of distances [m]


def moved_outside(
    points: np.ndarray, obstacles: Sequence[Obstacle], device: wp.DeviceLike = None
) -> tuple[np.ndarray, np.ndarray]:
    """Move strands (S, P, 3) [m] out of obstacles → (points (S, P, 3) float64, (S,) bool: which were moved).

    obstacles: with the distance that points keep. Roots do not move. Invalid colliders are ignored, as in `Colliders`.
    Raises `HairError` for non-finite points.
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
    # Rows of whole strands: broadcasting over three numbers takes three times as long.
    offsets = points.reshape(len(points), -1) - np.tile(origin, points.shape[1])
    original = wp.array(offsets.astype(np.float32).reshape(points.shape), dtype=wp.vec3, device=colliders.device)
    out = wp.empty_like(original)
    moved = wp.zeros(len(points), dtype=int, device=colliders.device)
    inputs = [Rows(original), _surface_of(colliders), _grid_of(colliders, points.size // 3)]
    parallel.launch(_keep_outside, len(points), inputs, [out, moved], colliders.device, least_rows=256)
    is_moved = moved.numpy() != 0
    if not is_moved.any():
        return points, is_moved
    before, after = original.numpy()[is_moved], out.numpy()[is_moved]
    is_same = (after == before).all(axis=2)[..., None]
    corrected = points.copy()
    corrected[is_moved] = np.where(is_same, points[is_moved], after + origin)
    return corrected, is_moved


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
    clear = float(0.0)  # distance that can be travelled before a surface may be near
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
            if clear > step_size:  # outside like the previous point: no surface between the two
                out_points[strand, i] = place
                last = place
                continue
            lack = float(1.0)
            gap = float(0.0)
            # The previous point is outside: a surface between the two is no farther than their distance.
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
