# SPDX-License-Identifier: GPL-3.0-or-later
"""Kernels of guide_layers.py: composition of layers, and their inverse for one layer, for eight guides at once.

The guides are in the lanes of vector registers, in single precision; sums of segments are in double precision.
"""

import numpy as np
import warp as wp

from ..geometry.strands import curve_offsets
from ..kernels import native_code, parallel
from ..kernels.checks import require_count, require_indices
from ..kernels.parallel import Rows
from .guide_layers import GuideLayers

# No gradients are needed. Without fused multiply-add all devices round alike.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

_WIDTH = 8  # guides of a thread
_LEAST_ROWS = 32  # blocks of guides for each core
_LEAST_COMPARED = 1024  # guides for each core


@wp.func_native(native_code.body(__file__, "compose_layers.cpp", WIDTH=_WIDTH))
def _compose_block(
    block: int,
    guides: wp.array[int],
    starts: wp.array[int],
    base: wp.array[wp.vec3],
    normals: wp.array[wp.vec3],
    tangents: wp.array[wp.vec3],
    turns: wp.array[wp.uint64],
    stretches: wp.array[wp.uint64],
    weights: wp.array2d[float],
    out_points: wp.array[wp.vec3],
):
    """Write the points of a block of guides with their layers."""


@wp.func_native(native_code.body(__file__, "record_layer.cpp", WIDTH=_WIDTH))
def _record_block(
    block: int,
    guides: wp.array[int],
    starts: wp.array[int],
    base: wp.array[wp.vec3],
    normals: wp.array[wp.vec3],
    tangents: wp.array[wp.vec3],
    turns: wp.array[wp.uint64],
    stretches: wp.array[wp.uint64],
    weights: wp.array2d[float],
    active: int,
    points: wp.array[wp.vec3],
    tolerance: float,
    out_turns: wp.array[wp.vec4],
    out_stretches: wp.array[float],
    out_is_made: wp.array[int],
):
    """Write the turns and stretches with which a layer makes a block of edited guides."""


@wp.func_native(native_code.body(__file__, "compare_guides.cpp", WIDTH=_WIDTH))
def _is_other(first: int, end: int, points: wp.array[wp.vec3], others: wp.array[wp.vec3], tolerance: float) -> wp.bool:
    """Return whether points of a guide differ from others by more than a fraction of its extent."""


@wp.kernel
def _compose(
    blocks: wp.array[int],
    guides: wp.array[int],
    starts: wp.array[int],
    base: wp.array[wp.vec3],
    normals: wp.array[wp.vec3],
    tangents: wp.array[wp.vec3],
    turns: wp.array[wp.uint64],
    stretches: wp.array[wp.uint64],
    weights: wp.array2d[float],
    # outputs
    out_points: wp.array[wp.vec3],
):
    block = blocks[wp.tid()]
    _compose_block(block, guides, starts, base, normals, tangents, turns, stretches, weights, out_points)


@wp.kernel
def _record(
    blocks: wp.array[int],
    guides: wp.array[int],
    starts: wp.array[int],
    base: wp.array[wp.vec3],
    normals: wp.array[wp.vec3],
    tangents: wp.array[wp.vec3],
    turns: wp.array[wp.uint64],
    stretches: wp.array[wp.uint64],
    weights: wp.array2d[float],
    active: int,
    points: wp.array[wp.vec3],
    tolerance: float,
    # outputs
    out_turns: wp.array[wp.vec4],
    out_stretches: wp.array[float],
    out_is_made: wp.array[int],
):
    _record_block(
        blocks[wp.tid()],
        guides,
        starts,
        base,
        normals,
        tangents,
        turns,
        stretches,
        weights,
        active,
        points,
        tolerance,
        out_turns,
        out_stretches,
        out_is_made,
    )


@wp.kernel
def _compare(
    starts: wp.array[int],
    points: wp.array[wp.vec3],
    others: wp.array[wp.vec3],
    tolerance: float,
    guides: wp.array[int],
    # outputs
    out_is_other: wp.array[wp.bool],
):
    guide = guides[wp.tid()]
    out_is_other[wp.tid()] = _is_other(starts[guide], starts[guide + 1], points, others, tolerance)


def are_other(
    starts: np.ndarray, points: np.ndarray, others: np.ndarray, guides: np.ndarray, tolerance: float
) -> np.ndarray:
    """Return (M,) bool: whether points of guides (M,) differ from others by more than a fraction of their extent.

    starts: (G + 1,), first point of each guide; points, others: (N, 3).
    """
    found = np.zeros(len(guides), bool)
    shapes = (_there(shape, wp.vec3) for shape in (points, others))
    inputs = [_there(starts, int, np.int32), *shapes, float(tolerance), Rows(_there(guides, int, np.int32))]
    outputs = [wp.array(found, dtype=wp.bool, device="cpu", copy=False)]
    parallel.launch(_compare, len(guides), inputs, outputs, "cpu", least_rows=_LEAST_COMPARED)
    return found


def compose(layers: GuideLayers, guides: np.ndarray | None = None, out: np.ndarray | None = None) -> np.ndarray:
    """Return the points (N, 3) float32 of guides with their layers.

    guides: (M,) indices of the guides to be composed, None for all; out: (N, 3) float32, in which their points are
    overwritten, None for a new array. Raises `HairError` if points or guides do not fit the layers.
    """
    if out is None:
        out = np.empty((len(layers.base), 3), np.float32)
    if guides is None:
        guides = np.arange(len(layers.counts), dtype=np.int32)
    require_count("composed points", len(out), len(layers.base))
    require_indices("guides", guides, len(layers.counts))
    if not len(out) or not len(guides):
        return out
    points = wp.array(out, dtype=wp.vec3, device="cpu", copy=False)
    blocks, inputs, _rows = _inputs(layers, guides)
    parallel.launch(_compose, len(blocks.array), [blocks, *inputs, points], [], "cpu", least_rows=_LEAST_ROWS)
    return out


def record(layers: GuideLayers, active: int, points: np.ndarray, guides: np.ndarray, tolerance: float) -> np.ndarray:
    """Overwrite the contiguous turns and stretches of a layer, so that it reproduces edited guides.

    active: index of the layer; points: (N, 3) float32 of the guides; guides: (M,) int32, indices of the edited guides.
    Returns (M,) bool: whether the layers give the edited points, up to a tolerance as a fraction of a guide's extent.
    """
    out = wp.array(layers.turns[active], dtype=wp.vec4, device="cpu", copy=False)
    out_stretches = wp.array(layers.stretches[active], dtype=float, device="cpu", copy=False)
    edited = wp.array(np.ascontiguousarray(points), dtype=wp.vec3, device="cpu", copy=False)
    is_made = wp.zeros(len(guides), dtype=int, device="cpu")
    blocks, inputs, _rows = _inputs(layers, guides)
    inputs = [blocks, *inputs, int(active), edited, float(tolerance), out, out_stretches, is_made]
    parallel.launch(_record, len(blocks.array), inputs, [], "cpu", least_rows=_LEAST_ROWS)
    return is_made.numpy().astype(bool)


def _inputs(layers, guides):
    """Return the blocks of guides, the arguments of both kernels that describe layers, and the arrays of layers.

    The arrays must be kept until the kernel has run, because the arguments contain only their addresses.
    """
    turns, stretches = ([_there(row, float) for row in values] for values in (layers.turns, layers.stretches))
    blocks = np.arange(-(-len(guides) // _WIDTH), dtype=np.int32)
    inputs = [
        _there(guides, int, np.int32),
        _there(curve_offsets(layers.counts), int, np.int32),
        _there(layers.base, wp.vec3),
        _there(layers.normals, wp.vec3),
        _there(layers.tangents, wp.vec3),
        _there([row.ptr for row in turns], wp.uint64, np.uint64),
        _there([row.ptr for row in stretches], wp.uint64, np.uint64),
        _there(layers.weights, float),
    ]
    return Rows(_there(blocks, int, np.int32)), inputs, (turns, stretches)


def _there(values, dtype, kind=np.float32):
    return wp.array(np.ascontiguousarray(values, kind), dtype=dtype, device="cpu", copy=False)
