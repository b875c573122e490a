# SPDX-License-Identifier: GPL-3.0-or-later
"""Kernels of guide_layers.py: composition of layers, and their inverse for one layer, for eight guides at once.

The guides are in the lanes of vector registers, in single precision; sums of segments are in double precision.
"""

import numpy as np
import warp as wp

from ..geometry.strands import curve_offsets
from ..kernels import native_code, parallel
from ..kernels.parallel import Rows
from .guide_layers import GuideLayers

# No gradients are needed. Without fused multiply-add all devices round alike.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

_WIDTH = 8  # guides of a thread
_LEAST_ROWS = 32  # blocks of guides for each core


@wp.func_native(native_code.body(__file__, "compose_layers.cpp", WIDTH=_WIDTH))
def _compose_block(
    block: int,
    guides: wp.array[int],
    starts: wp.array[int],
    base: wp.array[wp.vec3],
    normals: wp.array[wp.vec3],
    tangents: wp.array[wp.vec3],
    turns: wp.array2d[wp.vec4],
    stretches: wp.array2d[float],
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
    turns: wp.array2d[wp.vec4],
    stretches: wp.array2d[float],
    weights: wp.array2d[float],
    active: int,
    points: wp.array[wp.vec3],
    out_turns: wp.array[wp.vec4],
    out_stretches: wp.array[float],
):
    """Write the turns and stretches with which a layer makes a block of edited guides."""


@wp.kernel
def _compose(
    blocks: wp.array[int],
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
    turns: wp.array2d[wp.vec4],
    stretches: wp.array2d[float],
    weights: wp.array2d[float],
    active: int,
    points: wp.array[wp.vec3],
    # outputs
    out_turns: wp.array[wp.vec4],
    out_stretches: wp.array[float],
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
        out_turns,
        out_stretches,
    )


def compose(layers: GuideLayers, guides: np.ndarray | None = None, out: np.ndarray | None = None) -> np.ndarray:
    """Return the points (N, 3) float32 of guides with their layers.

    guides: (M,) indices of the guides to be composed, None for all; out: (N, 3) float32, in which their points are
    overwritten, None for a new array.
    """
    if out is None:
        out = np.empty((len(layers.base), 3), np.float32)
    if guides is None:
        guides = np.arange(len(layers.counts), dtype=np.int32)
    if not len(out) or not len(guides):
        return out
    blocks, inputs = _inputs(layers, guides)
    inputs.append(wp.array(out, dtype=wp.vec3, device="cpu", copy=False))
    parallel.launch(_compose, len(blocks.array), [blocks, *inputs], [], "cpu", least_rows=_LEAST_ROWS)
    return out


def record(layers: GuideLayers, active: int, points: np.ndarray, guides: np.ndarray) -> None:
    """Overwrite the contiguous turns and stretches of a layer, so that it reproduces edited guides.

    active: index of the layer; points: (N, 3) float32 of the guides; guides: (M,) int32, indices of the edited guides.
    """
    out = wp.array(layers.turns[active], dtype=wp.vec4, device="cpu", copy=False)
    out_stretches = wp.array(layers.stretches[active], dtype=float, device="cpu", copy=False)
    edited = wp.array(np.ascontiguousarray(points), dtype=wp.vec3, device="cpu", copy=False)
    blocks, inputs = _inputs(layers, guides)
    inputs = [blocks, *inputs, int(active), edited, out, out_stretches]
    parallel.launch(_record, len(blocks.array), inputs, [], "cpu", least_rows=_LEAST_ROWS)


def _inputs(layers, guides):
    """Return the blocks of guides, and the arguments of both kernels that describe layers."""

    def there(values, dtype, kind=np.float32):
        return wp.array(np.ascontiguousarray(values, kind), dtype=dtype, device="cpu", copy=False)

    blocks = np.arange(-(-len(guides) // _WIDTH), dtype=np.int32)
    return Rows(there(blocks, int, np.int32)), [
        there(guides, int, np.int32),
        there(curve_offsets(layers.counts), int, np.int32),
        there(layers.base, wp.vec3),
        there(layers.normals, wp.vec3),
        there(layers.tangents, wp.vec3),
        there(layers.turns, wp.vec4),
        there(layers.stretches, float),
        there(layers.weights, float),
    ]
