# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands that keep their shape relative to a moving course, such as the strand interpolated at their root.

A strand's point x beside the point c(s) of its course keeps its offset in a frame that moves with the course:

    x' = x + (c'(s) - c(s)) + (Q(s) - 1) (x - c(s) - d)

d is the offset of the strand's first point. It does not turn, so a root stays beside the root of its course. Where the
course does not move, both terms are zero and no bit changes. Q rotates the former tangents of the course to the present
tangents. At the root, Q is a rotation about the surface's normal, in proportion to how closely the course lies along
the surface, followed by the least rotation. Q continues along the course by least rotations [Bishop75], so that strands
are not twisted.
"""

import numpy as np
import warp as wp

from ..kernels import parallel
from ..kernels.checks import require_count
from ..kernels.parallel import Rows
from .guide_weights import frame

# No fused multiply-add: the cross product of a vector with itself is zero.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})


def carried(
    points: np.ndarray,
    starts: np.ndarray,
    places: np.ndarray,
    before: np.ndarray,
    now: np.ndarray,
    normals: np.ndarray,
    *,
    is_back: bool = False,
) -> np.ndarray:
    """Return the (N, 3) float32 [m] points of ragged strands moved with their courses.

    points (N, 3) float32 [m] and starts (S+1,) of the strands; places (N,) float32, the position of each point along
    its course, 0 to 1; before and now (S, P, 3) float32 [m], P > 1: their courses; normals (S, 3) float32, unit, of the
    surface at their roots; is_back: apply the inverse, to points beside the present courses.
    """
    counts = np.diff(starts)
    require_count("courses", len(before), len(counts))
    require_count("courses", len(now), len(counts))
    require_count("normals", len(normals), len(counts))
    require_count("points of a course", now.shape[1], before.shape[1])
    require_count("points", len(points), int(starts[-1]))
    require_count("places", len(places), len(points))
    if before.shape[1] < 2:
        raise ValueError("A course needs at least two points.")
    out = np.empty((len(points), 3), np.float32)
    parallel.launch(
        _carried,
        len(counts),
        inputs=[
            _vectors(points),
            Rows(wp.array(np.asarray(starts[:-1], np.int32), dtype=int, device="cpu")),
            Rows(wp.array(counts.astype(np.int32), dtype=int, device="cpu")),
            wp.array(np.clip(places, 0.0, 1.0).astype(np.float32), dtype=float, device="cpu"),
            Rows(_vectors(before)),
            Rows(_vectors(now)),
            Rows(_vectors(normals)),
            is_back,
            _vectors(out),
        ],
        outputs=[],
        device="cpu",
        least_rows=256,
    )
    return out


def _vectors(values):
    """Return a Warp array that shares the memory of (..., 3) float32."""
    return wp.array(np.ascontiguousarray(values, np.float32), dtype=wp.vec3, device="cpu", copy=False)


@wp.func
def _tangent(courses: wp.array2d[wp.vec3], strand: int, point: int):
    """Unit tangent by central differences; zero if points of the course coincide."""
    last = courses.shape[1] - 1
    return wp.normalize(courses[strand, wp.min(point + 1, last)] - courses[strand, wp.max(point - 1, 0)])


@wp.func
def _least_rotation(unit: wp.vec3, other: wp.vec3):
    """Quaternion that rotates one unit vector to another; the identity for opposite vectors."""
    cosine = wp.dot(unit, other)
    if cosine < -0.99999:
        return wp.quat_identity()
    across = wp.cross(unit, other)
    return wp.normalize(wp.quat(across[0], across[1], across[2], 1.0 + cosine))


@wp.func
def _leaning(part: float):
    """Weight of the rotation about the normal by the lean of a course: one at 30° above the surface, zero at 60°."""
    return part * part * part * part


@wp.func
def _turn_at_root(before: wp.array2d[wp.vec3], now: wp.array2d[wp.vec3], strand: int, normal: wp.vec3):
    """Rotation about the normal that best aligns a course along the surface with its present state."""
    tangent, bitangent = frame(normal)
    turned = wp.vec2()
    upright = float(0.0)
    for point in range(1, before.shape[1]):
        one = before[strand, point] - before[strand, point - 1]
        other = now[strand, point] - now[strand, point - 1]
        x, y = wp.dot(tangent, one), wp.dot(bitangent, one)
        u, v = wp.dot(tangent, other), wp.dot(bitangent, other)
        turned += wp.vec2(x * u + y * v, x * v - y * u)
        upright += wp.max(0.0, wp.dot(normal, one) * wp.dot(normal, other))
    lying = wp.length(turned)
    if lying == 0.0:
        return wp.quat_identity()
    level = _leaning(lying / (lying + upright))
    turned *= level / lying
    x, y = turned[0] + _leaning(upright / (lying + upright)), turned[1]
    if y == 0.0 and x >= 0.0:
        return wp.quat_identity()  # exact: the course does not move
    # By the tangent of half the angle, without functions whose rounding depends on the system's library.
    size = wp.length(wp.vec2(x, y))
    if x < 0.0:
        return wp.normalize(wp.quat((size - x) * normal, y))
    return wp.normalize(wp.quat(y * normal, size + x))


@wp.kernel
def _carried(
    points: wp.array[wp.vec3],
    starts: wp.array[int],
    counts: wp.array[int],
    places: wp.array[float],
    before: wp.array2d[wp.vec3],
    now: wp.array2d[wp.vec3],
    normals: wp.array[wp.vec3],
    is_back: bool,
    # outputs
    out_points: wp.array[wp.vec3],
):
    strand = wp.tid()
    segment_count = before.shape[1] - 1
    low = _turn_at_root(before, now, strand, normals[strand])
    low = _least_rotation(wp.quat_rotate(low, _tangent(before, strand, 0)), _tangent(now, strand, 0)) * low
    high = _least_rotation(wp.quat_rotate(low, _tangent(before, strand, 1)), _tangent(now, strand, 1)) * low
    segment = int(0)
    first = starts[strand]
    at_root = wp.vec3()
    for point in range(first, first + counts[strand]):
        place = places[point] * float(segment_count)
        while segment < segment_count - 1 and place > float(segment + 1):
            segment += 1
            low = high
            turned = wp.quat_rotate(low, _tangent(before, strand, segment + 1))
            high = wp.normalize(_least_rotation(turned, _tangent(now, strand, segment + 1)) * low)
        share = place - float(segment)
        rotation = wp.normalize((1.0 - share) * low + share * high)
        there = (1.0 - share) * before[strand, segment] + share * before[strand, segment + 1]
        here = (1.0 - share) * now[strand, segment] + share * now[strand, segment + 1]
        move = here - there
        offset = points[point] - there
        if is_back:
            move = there - here
            offset = points[point] - here
            rotation = wp.quat_inverse(rotation)
        if point == first:
            at_root = offset
        offset -= at_root
        out_points[point] = points[point] + move + (wp.quat_rotate(rotation, offset) - offset)
