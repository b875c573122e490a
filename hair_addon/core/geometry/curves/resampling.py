# SPDX-License-Identifier: GPL-3.0-or-later
"""Resampling of curves to equally spaced points, fast enough for brush strokes."""

import numpy as np
import warp as wp

from ...errors import HairError
from ...kernels import parallel
from ...kernels.parallel import Rows

# No gradients are needed. Without fused multiply-add all devices round alike.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

STEPS = 4  # straight pieces of a segment of a Catmull-Rom spline


@wp.func
def _spline(points: wp.array[wp.vec3], first: int, last: int, segment: int, t: float):
    """Evaluate a segment of a uniform Catmull-Rom spline [Catmull74] at t in [0, 1]; end points count twice."""
    before = points[wp.max(segment - 1, first)]
    start = points[segment]
    end = points[wp.min(segment + 1, last)]
    after = points[wp.min(segment + 2, last)]
    along = end - before
    bend = 2.0 * before - 5.0 * start + 4.0 * end - after
    twist = 3.0 * (start - end) + after - before
    return start + 0.5 * t * (along + t * (bend + t * twist))


@wp.func
def _place(points: wp.array[wp.vec3], first: int, last: int, step: int, step_count: int):
    """Return the end of a straight piece of a curve."""
    segment = wp.min(first + step // step_count, last)
    if step_count == 1 or segment == last:
        return points[segment]
    return _spline(points, first, last, segment, float(step % step_count) / float(step_count))


@wp.kernel
def _resample(
    points: wp.array[wp.vec3],
    ranges: wp.array2d[int],
    step_counts: wp.array[int],
    # outputs
    out_points: wp.array2d[wp.vec3],
):
    curve = wp.tid()
    first = ranges[curve, 0]
    last = ranges[curve, 1] - 1
    step_count = step_counts[curve]
    piece_count = (last - first) * step_count
    length = float(0.0)
    start = points[first]
    for piece in range(piece_count):
        end = _place(points, first, last, piece + 1, step_count)
        length += wp.length(end - start)
        start = end
    final = out_points.shape[1] - 1
    spacing = length / float(wp.max(final, 1))
    out_points[curve, 0] = points[first]
    point = int(1)
    along = float(0.0)
    start = points[first]
    for piece in range(piece_count):
        end = _place(points, first, last, piece + 1, step_count)
        span = wp.length(end - start)
        while point < final and float(point) * spacing <= along + span:
            share = wp.where(span > 0.0, (float(point) * spacing - along) / wp.max(span, 1.0e-37), 0.0)
            out_points[curve, point] = start + wp.clamp(share, 0.0, 1.0) * (end - start)
            point += 1
        along += span
        start = end
    # Rounding may leave the last points unset.
    while point <= final:
        out_points[curve, point] = points[last]
        point += 1


def resample(
    points: np.ndarray, starts: np.ndarray, point_count: int, is_smooth: np.ndarray | None = None
) -> np.ndarray:
    """Return (S, point_count, 3) float32: ragged curves, resampled at equal spacing, with the same ends.

    points: (N, 3), concatenated; starts: (S+1,) of each curve, the last entry is N; is_smooth: (S,) bool, for
    Catmull-Rom splines, None if all curves are polylines. A curve of one point repeats the point. Raises `HairError`
    for curves without points or with non-finite points.
    """
    starts = np.asarray(starts, np.int64)
    counts = np.diff(starts)
    if len(starts) < 1 or starts[0] != 0 or starts[-1] != len(points) or np.any(counts < 0) or point_count < 2:
        raise ValueError("starts must rise from 0 to the number of points, and point_count must be at least 2")
    if is_smooth is not None and len(is_smooth) != len(counts):
        raise ValueError(f"is_smooth must be ({len(counts)},), not ({len(is_smooth)},)")
    if np.any(counts == 0):
        raise HairError("{count} curves have no points: delete them.", count=np.count_nonzero(counts == 0))
    points = np.ascontiguousarray(points, np.float32)
    if not np.isfinite(points).all():
        raise HairError("Some points of the curves have non-finite coordinates: delete those curves.")
    if len(counts) == 0:
        return np.empty((0, point_count, 3), np.float32)
    step_counts = np.ones(len(counts), np.int32) if is_smooth is None else np.where(is_smooth, STEPS, 1)
    ranges = np.stack([starts[:-1], starts[1:]], axis=1).astype(np.int32)
    resampled = parallel.empty_vectors((len(counts), point_count), "cpu")
    parallel.launch(
        _resample,
        len(counts),
        inputs=[
            wp.array(points, dtype=wp.vec3, device="cpu", copy=False),
            Rows(wp.array(ranges, dtype=int, device="cpu", copy=False)),
            Rows(wp.array(step_counts.astype(np.int32), dtype=int, device="cpu", copy=False)),
        ],
        outputs=[resampled],
        device="cpu",
        least_rows=256,
    )
    return resampled.numpy()
