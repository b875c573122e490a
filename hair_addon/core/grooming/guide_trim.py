# SPDX-License-Identifier: GPL-3.0-or-later
"""Trimming of guides: each is cut where it first crosses a plane or a mesh."""

import numpy as np
import warp as wp

from ..geometry.mesh import TriMesh, check_mesh
from ..geometry.strands import lengths as lengths_of
from ..kernels import parallel
from ..kernels.parallel import Rows
from .guide_lengths import cut
from .guide_segments import only

# Nothing differentiates these kernels, and every device rounds as the processor does: no fused multiply-add.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

SHORTEST = 1e-3  # of a guide's length: what is left of it at least, so that it keeps a direction


def plane_crossings(points: np.ndarray, origin: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """(S,) [m]: how far along guides (S, P, 3) [m] they first cross a plane, to the side its normal (3,) points to.

    origin (3,) [m]: a point of the plane. Infinite for guides that do not, and for those rooted on that side.
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
    """(S,) [m]: how far along guides (S, P, 3) [m] they first cross the faces of a mesh; infinite if they do not.

    What is nearer to a root than `SHORTEST` does not count: guides may be rooted on the cutter. Raises `HairError` for
    a mesh without faces.
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
    """(S, P, 3) float32 [m]: guides cut where they cross, with as many points as they had.

    points (S, P, 3) [m]; crossings (S,) [m]: how far along each guide, infinite for none; weights (S,) in [0, 1]: at
    one half, half of what is beyond stays.
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
