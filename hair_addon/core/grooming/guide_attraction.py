# SPDX-License-Identifier: GPL-3.0-or-later
"""Attraction of guides to the surface: guides lie down along the surface at a clearance, with constant lengths."""

import numpy as np
import warp as wp

from ..geometry.closest_point import SurfaceQuery, normal_and_offset
from ..geometry.mesh import TriMesh
from ..kernels import parallel
from ..kernels.checks import require_count
from ..kernels.parallel import Rows
from .guide_shapes import joined, only, split, turned
from .guide_tool_settings import AttractSettings

# No gradients are needed. Without fused multiply-add all devices round alike.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

STEPS = 6  # of the search for a segment's rise; each step queries the surface below the segment's end
CLOSE = 1e-4  # tolerance of the height, relative to a segment's length
RAMP = 0.5  # rise per length at the root, until a guide reaches the clearance
DOWN = wp.constant(wp.vec3(0.0, 0.0, -1.0))


def attracted(
    mesh: TriMesh, points: np.ndarray, normals: np.ndarray, settings: AttractSettings, weights: np.ndarray
) -> np.ndarray:
    """Return guides (S, P, 3) float32 [m] that are closer to a checked `TriMesh`, but not below it.

    points (S, P, 3) [m]; normals (S, 3): unit, at the roots; weights (S,) in [0, 1]. Segments keep their lengths. Each
    guide is laid down as a path on the surface with the same sideways bends; its segments turn toward this path by
    their weights; segments below the surface are raised.
    """
    shares = settings.amount * np.asarray(weights, np.float64)
    directions, lengths = split(points)
    if not directions.shape[1] or not len(directions):
        return np.array(points, np.float32)
    query = SurfaceQuery(mesh)
    laid, _lengths = split(_march(query.mesh, mesh, points, normals, settings.clearance, lays_down=True))
    turned_down = joined(points, turned(directions, laid, shares[:, None]), lengths)
    kept = _march(query.mesh, mesh, turned_down, normals, settings.clearance, lays_down=False)
    # The kernels use single precision: the exact lengths are restored.
    return only(points, joined(points, split(kept)[0], lengths), shares)


def _march(surface, mesh, points, normals, clearance, lays_down):
    """Return strands (S, P, 3) float32 laid down at the clearance, or only raised to it where they are below."""
    require_count("normals", len(normals), len(points))

    def shared(array):
        return wp.array(np.ascontiguousarray(array, np.float32), dtype=wp.vec3, device="cpu", copy=False)

    path = parallel.empty_vectors(points.shape[:2], "cpu")
    parallel.launch(
        _follow,
        len(points),
        inputs=[
            surface.id,
            shared(mesh.vertex_normals),
            Rows(shared(points)),
            Rows(shared(normals)),
            clearance,
            lays_down,
        ],
        outputs=[path],
        device="cpu",
        least_rows=64,
    )
    return path.numpy()


@wp.func
def _side(vector: wp.vec3, normal: wp.vec3):
    """Return the component of a vector perpendicular to a unit normal."""
    return vector - wp.dot(vector, normal) * normal


@wp.func
def _least_turn(start: wp.vec3, end: wp.vec3):
    """Return the least rotation between unit vectors; the identity for opposite ones."""
    axis = wp.cross(start, end)
    cosine = wp.dot(start, end)
    if cosine < -0.9999:
        return wp.quat_identity()
    return wp.normalize(wp.quat(axis[0], axis[1], axis[2], 1.0 + cosine))


@wp.kernel
def _follow(
    surface: wp.uint64,
    vertex_normals: wp.array[wp.vec3],
    points: wp.array2d[wp.vec3],
    normals: wp.array[wp.vec3],
    clearance: float,
    lays_down: bool,
    # outputs
    out_path: wp.array2d[wp.vec3],
):
    guide = wp.tid()
    last = points.shape[1] - 1
    root_normal = normals[guide]
    position = points[guide, 0]
    out_path[guide, 0] = position
    # The direction in which an upright guide falls: its overall lean, or down.
    lean = _side(points[guide, last] - points[guide, 0], root_normal)
    if wp.length(lean) < 0.05 * wp.length(points[guide, last] - points[guide, 0]):
        lean = _side(DOWN, root_normal)
        if wp.length(lean) < 1.0e-3:
            lean = _side(wp.vec3(1.0, 0.0, 0.0), root_normal)
    lean = wp.normalize(lean)
    turn = wp.quat_identity()
    along = float(0.0)
    # Guides may be rooted off the surface: the gap extends the search radius.
    first = wp.mesh_query_point_no_sign(surface, position, 1.0e15)
    gap = wp.length(position - wp.mesh_eval_position(surface, first.face, first.u, first.v))
    for i in range(last):
        step = points[guide, i + 1] - points[guide, i]
        length = wp.length(step)
        ahead = wp.quat_rotate(turn, step / wp.max(length, 1.0e-30))
        along += length
        wanted = wp.min(clearance, wp.static(RAMP) * along)
        direction = ahead
        searching = length > 0.0
        for _search in range(wp.static(STEPS)):
            if searching:
                searching = False
                place = position + length * direction
                query = wp.mesh_query_point_no_sign(surface, place, gap + wanted + 2.0 * length)
                if query.result:
                    normal, away = normal_and_offset(surface, vertex_normals, query.face, query.u, query.v, place)
                    height = wp.dot(away, normal)
                    # Beyond the border of an open surface the nearest point lies sideways: no change there.
                    sideways = wp.length(away - height * normal)
                    is_over = sideways <= 0.5 * wp.max(wp.abs(height), wanted) + 1.0e-3 * length
                    is_off = wp.abs(wanted - height) > wp.static(CLOSE) * length
                    if is_over and is_off and (height < wanted or lays_down):
                        searching = True
                        rise = wp.clamp(wp.dot(direction, normal) + (wanted - height) / length, -1.0, 1.0)
                        side = _side(ahead, normal)
                        if wp.length(side) < 0.05:
                            side = _side(lean, normal)
                        if wp.length(side) > 0.0:
                            side = wp.normalize(side)
                        direction = wp.normalize(rise * normal + wp.sqrt(1.0 - rise * rise) * side)
        if lays_down:
            # The rest of the guide turns with this segment.
            turn = wp.normalize(_least_turn(ahead, direction) * turn)
            lean = direction
        position += length * direction
        out_path[guide, i + 1] = position
