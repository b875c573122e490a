# SPDX-License-Identifier: GPL-3.0-or-later
"""Conversion between combed points and simulated vertices, with the detail between the vertices.

Vertices are evenly spaced along a guide. The coarse curve h(u) between them is cubic Hermite, with tangents from the
frames of the segments. The offset o of each combed point is stored in frames R(u) that are interpolated between the
frames of the segments:

    p = h(u) + R(u) o

Rigid motion is exact, a guide at rest equals the combed guide, and bent curls keep their length.
"""

from dataclasses import dataclass

import numpy as np
import warp as wp

from ...errors import HairError
from ...geometry.curves import resampling
from ...kernels import parallel
from ...kernels.checks import require_count
from ...kernels.parallel import Rows
from . import rod_solver
from .rods import Rods

# No gradients are needed. Without fused multiply-add all devices round alike.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

SHORTEST = 1e-5  # least length [m] of a guide that is simulated with its own shape
SHORTEST_SEGMENT = 0.05  # least length of a segment relative to the mean, for guides that turn back on themselves
_STAND_IN = 0.01  # length [m] of the straight strand that replaces a guide of zero length


@dataclass(frozen=True)
class Detail:
    """Offsets of P combed points from the coarse curves of S guides: arrays on one device.

    places: (S, P) float32, in segments from the root; offsets: (S, P) vec3 in the frames at these places [m].
    """

    places: "wp.array2d[float]"
    offsets: "wp.array2d[wp.vec3]"


def vertices_of(points: np.ndarray, vertex_count: int) -> np.ndarray:
    """Return evenly spaced vertices (S, vertex_count, 3) float64 of combed guides (S, P, 3) [m], for simulation.

    Segments of nearly zero length, where a guide turns back on itself, continue in the previous direction; a guide of
    zero length becomes a short straight strand. `Detail` contains the difference, so the resulting guide is unchanged.
    Raises `HairError` for non-finite points.
    """
    count, point_count = points.shape[:2]
    starts = np.arange(count + 1) * point_count
    evenly = resampling.resample(points.reshape(-1, 3), starts, vertex_count).astype(np.float64)
    segments = np.diff(evenly, axis=1)
    sizes = np.linalg.norm(segments, axis=2)
    mean = sizes.mean(axis=1, keepdims=True)
    is_point = mean[:, 0] * (vertex_count - 1) < SHORTEST
    segments[is_point] = [0.0, 0.0, _STAND_IN / (vertex_count - 1)]
    is_short = (sizes < SHORTEST_SEGMENT * mean) & ~is_point[:, None]
    if not (is_short.any() or is_point.any()):
        return evenly
    for strand, segment in np.argwhere(is_short):
        before = segments[strand, segment - 1] if segment else np.array([0.0, 0.0, 1.0])
        segments[strand, segment] = before / np.linalg.norm(before) * mean[strand]
    changed = np.concatenate([evenly[:, :1], evenly[:, :1] + np.cumsum(segments, axis=1)], axis=1)
    return np.where((is_short.any(axis=1) | is_point)[:, None, None], changed, evenly)


def detail_of(points: np.ndarray, rods: Rods) -> Detail:
    """Return the `Detail` of combed guides (S, P, 3) [m] whose `Rods` are at the vertices of `vertices_of`.

    Raises `HairError` if counts do not match.
    """
    require_count("guides", len(points), rods.strand_count)
    lengths = np.linalg.norm(np.diff(np.asarray(points, np.float64), axis=1), axis=2)
    along = np.concatenate([np.zeros((len(points), 1)), np.cumsum(lengths, axis=1)], axis=1)
    whole = along[:, -1:]
    places = along / np.where(whole > SHORTEST, whole, np.inf) * rods.segment_count
    places = wp.array(places, dtype=float, device=rods.device)
    combed = wp.array(np.ascontiguousarray(points, np.float32), dtype=wp.vec3, device=rods.device)
    offsets = wp.empty(points.shape[:2], dtype=wp.vec3, device=rods.device)
    _launch(_leave_over, [Rows(places), Rows(combed)], offsets, rods)
    return Detail(places, offsets)


def detailed_points(detail: Detail, rods: Rods) -> wp.array:
    """Return the points (S, P) vec3 [m] of simulated guides with their detail, on the rods' device."""
    require_count("guides", len(detail.places), rods.strand_count)
    points = wp.empty(detail.offsets.shape, dtype=wp.vec3, device=rods.device)
    _launch(_put_back, [Rows(detail.places), Rows(detail.offsets)], points, rods)
    return points


def _launch(kernel, inputs, out, rods):
    segment_count = rods.segment_count
    for name in ("positions", "frames"):
        require_count(f"rows of {name}", getattr(rods.arrays, name).shape[1], rod_solver.row_count(name, segment_count))
    if len(rods.arrays.positions) * rods.lanes < rods.strand_count:
        raise HairError("Hair data does not match: there are fewer rods than strands. Regenerate the strands.")
    strands = wp.array(np.arange(rods.strand_count, dtype=np.int32), dtype=int, device=rods.device)
    shared = [rods.arrays.positions, rods.arrays.frames]
    parallel.launch(kernel, rods.strand_count, [Rows(strands), *inputs, *shared], [out], rods.device, least_rows=128)


@wp.func
def _point(positions: wp.array3d[float], group: int, lane: int, i: int):
    return wp.vec3(positions[group, 3 * i, lane], positions[group, 3 * i + 1, lane], positions[group, 3 * i + 2, lane])


@wp.func
def _frame(frames: wp.array3d[float], group: int, lane: int, j: int):
    return wp.quat(
        frames[group, 4 * j, lane],
        frames[group, 4 * j + 1, lane],
        frames[group, 4 * j + 2, lane],
        frames[group, 4 * j + 3, lane],
    )


@wp.func
def _tangent(frames: wp.array3d[float], group: int, lane: int, i: int):
    """Return the tangent of the coarse curve at a vertex: the mean direction of the adjacent segments."""
    last = frames.shape[1] // 4 - 1
    z = wp.vec3(0.0, 0.0, 1.0)
    before = wp.quat_rotate(_frame(frames, group, lane, wp.max(i - 1, 0)), z)
    after = wp.quat_rotate(_frame(frames, group, lane, wp.min(i, last)), z)
    tangent = before + after
    # The mean of opposite directions is undefined.
    return wp.where(wp.length(tangent) > 1.0e-3, wp.normalize(tangent), after)


@wp.func
def _coarse(positions: wp.array3d[float], frames: wp.array3d[float], group: int, lane: int, place: float):
    """Return h(u), cubic Hermite."""
    segment = wp.min(int(place), positions.shape[1] // 3 - 2)
    t = place - float(segment)
    start = _point(positions, group, lane, segment)
    end = _point(positions, group, lane, segment + 1)
    size = wp.length(end - start)
    rise = t * t * (3.0 - 2.0 * t)
    out = t * (1.0 - t) * (1.0 - t) * size
    into = t * t * (t - 1.0) * size
    return (
        start
        + rise * (end - start)
        + out * _tangent(frames, group, lane, segment)
        + into * _tangent(frames, group, lane, segment + 1)
    )


@wp.func
def _frame_at(frames: wp.array3d[float], group: int, lane: int, place: float):
    """Return R(u), interpolated between the midpoints of segments; constant beyond the first and the last one."""
    last = frames.shape[1] // 4 - 1
    along = wp.clamp(place - 0.5, 0.0, float(last))
    segment = wp.min(int(along), wp.max(last - 1, 0))
    t = along - float(segment)
    a = _frame(frames, group, lane, segment)
    b = _frame(frames, group, lane, wp.min(segment + 1, last))
    if wp.dot(a, b) < 0.0:
        b = -b
    return wp.normalize(a * (1.0 - t) + b * t)


@wp.kernel
def _leave_over(
    strands: wp.array[int],
    places: wp.array2d[float],
    points: wp.array2d[wp.vec3],
    positions: wp.array3d[float],
    frames: wp.array3d[float],
    # outputs
    out_offsets: wp.array2d[wp.vec3],
):
    row = wp.tid()
    group = strands[row] // positions.shape[2]
    lane = strands[row] % positions.shape[2]
    for point in range(points.shape[1]):
        place = places[row, point]
        apart = points[row, point] - _coarse(positions, frames, group, lane, place)
        out_offsets[row, point] = wp.quat_rotate_inv(_frame_at(frames, group, lane, place), apart)


@wp.kernel
def _put_back(
    strands: wp.array[int],
    places: wp.array2d[float],
    offsets: wp.array2d[wp.vec3],
    positions: wp.array3d[float],
    frames: wp.array3d[float],
    # outputs
    out_points: wp.array2d[wp.vec3],
):
    row = wp.tid()
    group = strands[row] // positions.shape[2]
    lane = strands[row] % positions.shape[2]
    for point in range(offsets.shape[1]):
        place = places[row, point]
        turned = wp.quat_rotate(_frame_at(frames, group, lane, place), offsets[row, point])
        out_points[row, point] = _coarse(positions, frames, group, lane, place) + turned
