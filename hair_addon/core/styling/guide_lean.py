# SPDX-License-Identifier: GPL-3.0-or-later
"""Leaning of guides with a clearance from the surface: the styles Lean and Wet (lean.py, wet.py) on guides.

t'_i = unit((1 - A) t_i + A D), or t_i if the sum is shorter than 1e-3. A segment that would end nearer to the surface
than the clearance is rotated toward the surface's normal until it ends at the clearance; lengths are preserved.
"""

import numpy as np
import warp as wp

from ..errors import HairError
from ..geometry.closest_point import SurfaceQuery, normal_and_offset
from ..kernels import parallel
from ..kernels.checks import require_count

# No gradients are needed. Without fused multiply-add all devices round alike.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

_LEAST_AMOUNT = wp.constant(0.05)  # amount from which guides keep the full clearance
_STEEPEST = wp.constant(0.9)  # largest sine of the angle at which guides rise: near a right angle they would jump
_UNKNOWN = wp.constant(1.0e30)
_LEAST_ROWS = 64  # fewer guides are not worth a thread
_CORRECTIONS = wp.constant(4)  # per segment: a lifted point may come nearer to another part of the surface


@wp.kernel
def _lean(
    surface: wp.uint64,
    vertex_normals: wp.array[wp.vec3],
    points: wp.array2d[wp.vec3],
    amounts: wp.array2d[float],
    directions: wp.array[wp.vec3],
    clearances: wp.array[float],
    # outputs
    out_points: wp.array2d[wp.vec3],
):
    guide = wp.tid()
    clearance = clearances[guide]
    corners = wp.mesh_get(surface).points
    indices = wp.mesh_get(surface).indices
    position = points[guide, 0]
    out_points[guide, 0] = position
    arc = float(0.0)
    largest_amount = float(0.0)
    for i in range(1, points.shape[1]):
        segment = points[guide, i] - points[guide, i - 1]
        size = wp.length(segment)
        arc += size
        amount = amounts[guide, i]
        largest_amount = wp.max(largest_amount, amount)
        if largest_amount == 0.0 or size < 1.0e-12:
            position += segment
            out_points[guide, i] = position
            continue
        forward = segment / size
        leaned = (1.0 - amount) * forward + amount * directions[guide]
        if wp.length(leaned) >= 1.0e-3:
            forward = wp.normalize(leaned)
        # A guide leaves the surface gradually, and one that hardly leans keeps its combed shape.
        wanted = wp.min(clearance, 0.5 * arc)
        hold = wp.min(largest_amount / _LEAST_AMOUNT, 1.0)
        goal = float(_UNKNOWN)
        for _correction in range(_CORRECTIONS):
            ahead = position + size * forward
            query = wp.mesh_query_point_no_sign(surface, ahead, 4.0 * (clearance + size))
            lift = float(0.0)
            if query.result:
                normal, away = normal_and_offset(surface, vertex_normals, query.face, query.u, query.v, ahead)
                height = wp.dot(away, normal)
                # Beyond the border of an open surface the nearest point is sideways: guides hang down there.
                sideways = wp.length(away - height * normal)
                part = sideways / (0.5 * wp.length(away) + 0.1 * wanted + 1.0e-6 * size)
                if goal == _UNKNOWN:
                    goal = height + hold * wp.max(wanted - height, 0.0)
                lift = wp.clamp(1.5 - part, 0.0, 1.0) * wp.max(goal - height, 0.0)
                if lift > 0.0:
                    # Rotated towards the normal until its end is higher by the lift.
                    rise = wp.dot(forward, normal)
                    along = forward - rise * normal
                    if wp.length(along) < 1.0e-3:
                        # Perpendicular to the surface, any direction along it works: that of an edge.
                        edge = corners[indices[3 * query.face + 1]] - corners[indices[3 * query.face]]
                        along = edge - wp.dot(edge, normal) * normal
                    rise = wp.max(rise, wp.min(rise + lift / size, _STEEPEST))
                    forward = rise * normal + wp.sqrt(1.0 - rise * rise) * wp.normalize(along)
            if lift <= 0.0:
                break  # further corrections would give the same
        position += size * forward
        out_points[guide, i] = position


def leaned(
    points: np.ndarray,
    amounts: np.ndarray,
    directions: np.ndarray,
    surface: SurfaceQuery,
    vertex_normals: np.ndarray,
    clearances: np.ndarray,
) -> np.ndarray:
    """Return (G, P, 3) float32 [m]: guides whose segments are rotated toward directions.

    points: (G, P, 3) [m]; amounts: (G, P) in [0, 1]; directions: (G, 3) unit; surface: for the clearance;
    vertex_normals: (V, 3) of its mesh; clearances: (G,) [m]. A guide whose amounts are all zero keeps its bits.
    """
    require_count("amounts", len(amounts), len(points))
    require_count("directions", len(directions), len(points))
    require_count("clearances", len(clearances), len(points))
    require_count("points", amounts.shape[1], points.shape[1])
    require_count("normals", len(vertex_normals), len(surface.mesh.points))
    if not (np.isfinite(points).all() and np.isfinite(directions).all()):
        raise HairError("Guides with non-finite coordinates cannot lean.")
    device = surface.mesh.device
    columns = (
        (vertex_normals, wp.vec3),
        (points, wp.vec3),
        (amounts, float),
        (directions, wp.vec3),
        (clearances, float),
    )
    there = [wp.array(np.ascontiguousarray(array, np.float32), dtype=kind, device=device) for array, kind in columns]
    made = wp.empty(points.shape[:2], dtype=wp.vec3, device=device)
    normals, *rows = there
    inputs = [surface.mesh.id, normals, *map(parallel.Rows, rows)]
    parallel.launch(_lean, len(points), inputs, [made], device, least_rows=_LEAST_ROWS)
    result = made.numpy()
    is_still = ~(amounts > 0.0).any(axis=1)
    result[is_still] = points[is_still]
    return result
