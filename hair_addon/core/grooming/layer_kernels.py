# SPDX-License-Identifier: GPL-3.0-or-later
"""Kernels of guide_layers.py: composition of layers, and their inverse for one layer, a thread for each guide."""

import numpy as np
import warp as wp

from ..geometry.strands import curve_offsets
from ..kernels import parallel
from ..kernels.parallel import Rows
from .guide_layers import GuideLayers

# Nothing differentiates these kernels, and every device rounds as the processor does: no fused multiply-add.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

_SHORT = wp.constant(wp.float64(1e-6))  # of a guide's mean segment: shorter segments have no length to multiply
_LONGEST = wp.constant(30.0)  # limit of logarithms of length ratios
_ALMOST_TWO_TURNS = wp.constant(6.28)  # the largest angle that a quaternion stores
_LEAST_ROWS = 256  # guides per thread


def compose(layers: GuideLayers) -> np.ndarray:
    """Return the points (N, 3) float32 of guides with their layers."""
    out = np.empty((len(layers.base), 3), np.float32)
    guides = np.arange(len(layers.counts), dtype=np.int32)
    inputs = [_rows(guides), *_inputs(layers), wp.array(out, dtype=wp.vec3, device="cpu", copy=False)]
    parallel.launch(_compose, len(guides), inputs, [], "cpu", least_rows=_LEAST_ROWS)
    return out


def record(layers: GuideLayers, active: int, points: np.ndarray, guides: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the turns (L, N, 4) and stretches (L, N) with which a layer makes edited guides.

    active: index of the layer; points: (N, 3) float32 of the guides; guides: (M,) int32, those that were edited.
    """
    turns, stretches = layers.turns.copy(), layers.stretches.copy()
    out = wp.array(turns[active], dtype=wp.vec4, device="cpu", copy=False)
    out_stretches = wp.array(stretches[active], dtype=float, device="cpu", copy=False)
    edited = wp.array(np.ascontiguousarray(points), dtype=wp.vec3, device="cpu", copy=False)
    inputs = [_rows(guides), *_inputs(layers), int(active), edited, out, out_stretches]
    parallel.launch(_record, len(guides), inputs, [], "cpu", least_rows=_LEAST_ROWS)
    return turns, stretches


def _rows(guides):
    return Rows(wp.array(guides, dtype=int, device="cpu", copy=False))


def _inputs(layers):
    """Return the arguments of both kernels that describe layers."""

    def there(values, dtype, kind=np.float32):
        return wp.array(np.ascontiguousarray(values, kind), dtype=dtype, device="cpu", copy=False)

    return [
        there(curve_offsets(layers.counts), int, np.int32),
        there(layers.base, wp.vec3),
        there(layers.normals, wp.vec3),
        there(layers.tangents, wp.vec3),
        there(layers.turns, wp.vec4),
        there(layers.stretches, float),
        there(layers.weights, float),
    ]


@wp.func
def _double(vector: wp.vec3):
    return wp.vec3d(wp.float64(vector[0]), wp.float64(vector[1]), wp.float64(vector[2]))


@wp.func
def _part(stored: wp.vec4, weight: float):
    """Return a part of a turn as a quaternion w, x, y, z; stored angles are below two full turns."""
    if weight == 1.0:
        return stored
    axis = wp.vec3(stored[1], stored[2], stored[3])
    sine = wp.length(axis)
    half = weight * wp.atan2(sine, stored[0])
    axis = axis * (wp.sin(half) / sine)
    return wp.vec4(wp.cos(half), axis[0], axis[1], axis[2])


@wp.func
def _is_turn(stored: wp.vec4):
    return stored[1] != 0.0 or stored[2] != 0.0 or stored[3] != 0.0


@wp.func
def _times(a: wp.vec4, b: wp.vec4):
    return wp.vec4(
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] + a[2] * b[0] + a[3] * b[1] - a[1] * b[3],
        a[0] * b[3] + a[3] * b[0] + a[1] * b[2] - a[2] * b[1],
    )


@wp.func
def _turned(turn: wp.vec4, vector: wp.vec3):
    axis = wp.vec3(turn[1], turn[2], turn[3])
    twice = 2.0 * wp.cross(axis, vector)
    return vector + turn[0] * twice + wp.cross(axis, twice)


@wp.func
def _least_turn(start: wp.vec3, end: wp.vec3):
    """Return the least rotation between unit vectors as a quaternion."""
    cosine = wp.dot(start, end)
    if cosine < -0.999999:
        aside = wp.cross(start, wp.vec3(1.0, 0.0, 0.0))
        if wp.length(aside) < 0.1:
            aside = wp.cross(start, wp.vec3(0.0, 1.0, 0.0))
        # A half turn about an axis across both, which takes the start to the end up to rounding.
        aside = wp.normalize(aside)
        aside = wp.normalize(aside - 0.5 * wp.dot(aside, end) * end)
        return wp.vec4(0.0, aside[0], aside[1], aside[2])
    axis = wp.cross(start, end)
    return wp.normalize(wp.vec4(1.0 + cosine, axis[0], axis[1], axis[2]))


@wp.func
def _carried(tangent: wp.vec3d, before: wp.vec3d, after: wp.vec3d):
    """Return a unit tangent across `before`, carried by the least rotation to a unit tangent across `after`."""
    found = tangent
    total = wp.float64(1.0) + wp.dot(before, after)
    if total > wp.float64(1e-6):
        found = tangent - wp.dot(tangent, after) / total * (before + after)
    found = found - after * wp.dot(found, after)
    if wp.length(found) < wp.float64(1e-9):
        found = tangent
    return wp.normalize(found)


@wp.func
def _short_length(base: wp.array[wp.vec3], first: int, end: int):
    """Return the length below which a segment of a guide counts as none."""
    total = wp.float64(0.0)
    for point in range(first + 1, end):
        total += wp.length(_double(base[point]) - _double(base[point - 1]))
    return _SHORT * total / wp.float64(wp.max(end - first - 1, 1))


@wp.kernel
def _compose(
    guides: wp.array[int],
    starts: wp.array[int],
    base: wp.array[wp.vec3],
    normals: wp.array[wp.vec3],
    tangents: wp.array[wp.vec3],
    turns: wp.array2d[wp.vec4],
    stretches: wp.array2d[float],
    weights: wp.array2d[float],
    # outputs
    out_points: wp.array[wp.vec3],
):
    guide = guides[wp.tid()]
    first = starts[guide]
    end = starts[guide + 1]
    if end > first:
        out_points[first] = base[first]
        short = _short_length(base, first, end)
        before = wp.normalize(_double(normals[guide]))
        tangent = wp.normalize(_double(tangents[guide]))
        shift = wp.vec3d(wp.float64(0.0), wp.float64(0.0), wp.float64(0.0))
        is_base = int(1)
        for point in range(first + 1, end):
            segment = _double(base[point]) - _double(base[point - 1])
            length = wp.length(segment)
            direction = before
            if length > short:
                direction = segment / length
            tangent = _carried(tangent, before, direction)
            turn = wp.vec4(1.0, 0.0, 0.0, 0.0)
            stretch = float(0.0)
            for layer in range(weights.shape[0]):
                weight = weights[layer, guide]
                if weight != 0.0:
                    stored = turns[layer, point]
                    if _is_turn(stored):
                        turn = _times(turn, _part(stored, weight))
                    stretch += weight * stretches[layer, point]
            if turn[1] != 0.0 or turn[2] != 0.0 or stretch != 0.0:
                is_base = int(0)
                local = wp.normalize(_double(_turned(wp.normalize(turn), wp.vec3(0.0, 0.0, 1.0))))
                side = wp.cross(direction, tangent)
                if stretch != 0.0:
                    length = wp.max(length, short) * wp.exp(wp.float64(wp.clamp(stretch, -_LONGEST, _LONGEST)))
                after = length * (local[0] * tangent + local[1] * side + local[2] * direction)
                shift += after - segment
            if is_base == 1:
                out_points[point] = base[point]
            else:
                place = _double(base[point]) + shift
                out_points[point] = wp.vec3(float(place[0]), float(place[1]), float(place[2]))
            before = direction


@wp.kernel
def _record(
    guides: wp.array[int],
    starts: wp.array[int],
    base: wp.array[wp.vec3],
    normals: wp.array[wp.vec3],
    tangents: wp.array[wp.vec3],
    turns: wp.array2d[wp.vec4],
    stretches: wp.array2d[float],
    weights: wp.array2d[float],
    active: int,
    points: wp.array[wp.vec3],
    # outputs
    out_turns: wp.array[wp.vec4],
    out_stretches: wp.array[float],
):
    guide = guides[wp.tid()]
    first = starts[guide]
    end = starts[guide + 1]
    own = weights[active, guide]
    short = _short_length(base, first, end)
    before = wp.normalize(_double(normals[guide]))
    tangent = wp.normalize(_double(tangents[guide]))
    last = before
    for point in range(first + 1, end):
        segment = _double(base[point]) - _double(base[point - 1])
        length = wp.length(segment)
        direction = before
        if length > short:
            direction = segment / length
        tangent = _carried(tangent, before, direction)
        side = wp.cross(direction, tangent)
        below = wp.vec4(1.0, 0.0, 0.0, 0.0)
        above = wp.vec4(1.0, 0.0, 0.0, 0.0)
        stretch = float(0.0)
        for layer in range(weights.shape[0]):
            weight = weights[layer, guide]
            if layer != active and weight != 0.0:
                stored = turns[layer, point]
                if _is_turn(stored):
                    if layer < active:
                        below = _times(below, _part(stored, weight))
                    else:
                        above = _times(above, _part(stored, weight))
                stretch += weight * stretches[layer, point]
        edited = _double(points[point]) - _double(points[point - 1])
        edited_length = wp.length(edited)
        wanted = last
        if edited_length > short:
            wanted = edited / edited_length
        last = wanted
        local = wp.vec3(float(wp.dot(tangent, wanted)), float(wp.dot(side, wanted)), float(wp.dot(direction, wanted)))
        below = wp.normalize(below)
        local = wp.normalize(_turned(wp.vec4(below[0], -below[1], -below[2], -below[3]), local))
        along = wp.vec3(0.0, 0.0, 1.0)
        turn = _least_turn(along, local)
        if above[1] * above[1] + above[2] * above[2] > 0.0:
            # The layers above turn another direction to the wanted one: the least change of the present turn.
            present = wp.vec4(1.0, 0.0, 0.0, 0.0)
            if _is_turn(turns[active, point]):
                present = wp.normalize(_part(turns[active, point], own))
            now = _turned(present, wp.normalize(_turned(wp.normalize(above), along)))
            turn = _times(_least_turn(wp.normalize(now), local), present)
        if turn[0] < 0.0:
            turn = -turn
        axis = wp.vec3(turn[1], turn[2], turn[3])
        sine = wp.length(axis)
        if own != 1.0 and sine > 0.0:
            half = wp.min(wp.atan2(sine, turn[0]) / own, 0.5 * _ALMOST_TWO_TURNS)
            axis = axis * (wp.sin(half) / sine)
            turn = wp.vec4(wp.cos(half), axis[0], axis[1], axis[2])
        out_turns[point] = turn
        ratio = float(0.0)
        if short > wp.float64(0.0):
            ratio = float(wp.log(wp.max(edited_length, short) / wp.max(length, short)))
        out_stretches[point] = wp.clamp((ratio - stretch) / own, -_LONGEST, _LONGEST)
        before = direction
