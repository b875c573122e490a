# SPDX-License-Identifier: GPL-3.0-or-later
"""Trimming of guides: each guide is cut where it first crosses a plane or a mesh."""

import numpy as np
import warp as wp

from ..geometry.mesh import TriMesh, check_mesh
from ..geometry.strands import lengths as lengths_of
from ..kernels import parallel
from ..kernels.parallel import Rows
from .guide_lengths import cut
from .guide_shapes import only

# No gradients are needed. Without fused multiply-add all devices round alike.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

SHORTEST = 1e-3  # least remaining fraction of a guide's length, which preserves its direction


def plane_crossings(points: np.ndarray, origin: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Return the arc length (S,) [m] at which guides (S, P, 3) [m] first cross a plane to the side of its normal (3,).

    origin (3,) [m]: a point of the plane. Infinite for guides without a crossing, and for guides rooted on that side.
    """
    heights = (np.asarray(points, np.float64) - origin) @ np.asarray(normal, np.float64)
    is_crossing = (heights[:, :-1] <= 0.0) & (heights[:, 1:] > 0.0)
    has_crossing = is_crossing.any(axis=1) & (heights[:, 0] <= 0.0)
    segment, rows = is_crossing.argmax(axis=1), np.arange(len(points))
    before, after = heights[rows, segment], heights[rows, segment + 1]
    steps = np.linalg.norm(np.diff(np.asarray(points, np.float64), axis=1), axis=2)
    along = np.concatenate([np.zeros((len(points), 1)), np.cumsum(steps, axis=1)], axis=1)
    rise = np.where(has_crossing, after - before, 1.0)
    return np.where(has_crossing, along[rows, segment] - before / rise * steps[rows, segment], np.inf)


def mesh_crossings(points: np.ndarray, cutter: TriMesh) -> np.ndarray:
    """Return the arc length (S,) [m] at which guides (S, P, 3) [m] first cross the faces of a mesh; infinite if never.

    Crossings within `SHORTEST` of the root are ignored, because guides may be rooted on the cutter. Raises `HairError`
    for a mesh without faces.
    """
    check_mesh(cutter)
    triangles = cutter.triangles[cutter.areas > 0.0]
    mesh = wp.Mesh(
        points=wp.array(cutter.vertices, dtype=wp.vec3, device="cpu"),
        indices=wp.array(triangles.ravel(), dtype=int, device="cpu"),
    )
    points = np.ascontiguousarray(points, np.float32)
    starts = (SHORTEST * lengths_of(points)).astype(np.float32)
    found = wp.empty(len(points), dtype=float, device="cpu")
    parallel.launch(
        _cross,
        len(points),
        inputs=[
            mesh.id,
            Rows(wp.array(points, dtype=wp.vec3, device="cpu", copy=False)),
            Rows(wp.array(starts, dtype=float, device="cpu", copy=False)),
        ],
        outputs=[found],
        device="cpu",
        least_rows=256,
    )
    return found.numpy().astype(np.float64)


def trimmed(points: np.ndarray, crossings: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return guides (S, P, 3) float32 [m] cut at their crossings, with the same number of points.

    points (S, P, 3) [m]; crossings (S,) [m]: arc lengths, infinite for none; weights (S,) in [0, 1]: fraction of the
    part beyond the crossing that is removed.
    """
    full = lengths_of(np.asarray(points, np.float64))
    ends = np.maximum(full + weights * (np.minimum(crossings, full) - full), SHORTEST * full)
    is_cut = ends < full
    return only(points, cut(points, ends), is_cut)


@wp.kernel
def _cross(
    cutter: wp.uint64,
    points: wp.array2d[wp.vec3],
    starts: wp.array[float],
    # outputs
    out_crossings: wp.array[float],
):
    guide = wp.tid()
    start = starts[guide]
    along = float(0.0)
    found = float(wp.inf)
    for segment in range(points.shape[1] - 1):
        before = points[guide, segment]
        step = points[guide, segment + 1] - before
        length = wp.length(step)
        if found == wp.inf and length > 0.0 and along + length > start:
            direction = step / length
            skipped = wp.max(start - along, 0.0)
            query = wp.mesh_query_ray(cutter, before + skipped * direction, direction, length - skipped)
            if query.result:
                found = along + skipped + query.t
        along += length
    out_crossings[guide] = found
