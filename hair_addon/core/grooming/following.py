# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands computed from their guides: all of them, in other threads, or some. Combing repeats this without a search.

Warp is imported late, because the import is slow.
"""

import threading
import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TYPE_CHECKING

import numpy as np

from .. import geometry, interpolation, kernels
from ..errors import HairError
from ..geometry.strands import Strands
from ..interpolation.hair_binding import HairBinding
from ..kernels.checks import require_count, require_indices

if TYPE_CHECKING:
    import warp as wp

    from ..interpolation.guide_weights import GuideWeights
    from ..styling.stack import Styling

# Seconds for other threads to prepare their kernels at most, and to start them, before this one takes the GIL again:
# what it does then may hold the GIL for longer than the kernels take.
PREPARATION, HEAD_START = 0.02, 0.0005

_AS_BOUND = np.eye(3)  # the axes of a binding itself


def strands_now(
    binding: HairBinding,
    guides: Strands,
    weights: "GuideWeights",
    styling: "Styling | None" = None,
    out: "wp.array2d[wp.vec3] | None" = None,
    under_way: Callable[[], None] | None = None,
) -> "wp.array2d[wp.vec3]":
    """Return (S, P) vec3 [m] on the binding's device: strands for the guides as combed now.

    It computes the weighted sum, and applies styles to it. `follow_some` does the same for some of the strands.

    guides: as strands follow them, which are those of `Styling.guides` for styled strands; weights: from `weights_now`
    for the same guides; out: array to fill and return, None for a new one; under_way: called when the strands' kernels
    run, before styles.
    """
    points = _weighted_sum(binding, guides, weights, out, under_way)
    if styling is not None:
        centres = [level.binding for level in styling.levels]
        styling.apply(points, [(_weighted_sum(own, guides, weights_now(own, guides)), None) for own in centres])
    return points


def _weighted_sum(binding, guides, weights, out=None, under_way=None):
    # A kernel given memory of another device reads garbage, or causes an error that affects its whole device.
    guide_points = guides.points.to(binding.positions.device)
    return interpolation.interpolation.interpolate(
        binding.positions,
        binding.normals,
        guide_points,
        binding.guide_normals,
        weights,
        binding.keep_length,
        out,
        under_way,
    )


def combed(guides: Strands, before: Strands) -> np.ndarray | None:
    """Indices (M,) of guides that were combed since; None where they are others, or rooted elsewhere."""
    has_same_roots = guides.roots is before.roots or guides.roots.is_same(before.roots)
    if guides.points.shape != before.points.shape or not has_same_roots:
        return None
    is_other = guides.numpy() != before.numpy()
    if np.count_nonzero(is_other) > len(is_other):
        return np.flatnonzero(is_other.any(axis=(1, 2)))
    return np.unique(np.flatnonzero(is_other) // is_other[0].size)  # for few: half the time


def follow_guides(binding: HairBinding, guides: Strands, styling: "Styling | None" = None) -> Strands:
    """Strands of a binding for the guides as they are combed now, with styles."""
    guides = guides if styling is None else styling.guides(guides)
    return Strands(strands_now(binding, guides, weights_now(binding, guides), styling), binding.roots)


def growing_points(
    binding: HairBinding,
    guides: Strands,
    weights: "GuideWeights",
    axes: np.ndarray = _AS_BOUND,
    out: np.ndarray | None = None,
    styling: "Styling | None" = None,
) -> Future[np.ndarray]:
    """A future of the points of `follow_guides`, (S, P, 3) float32 in the processor's memory.

    They are computed in other threads, so that this one can do what it has to do with something else. guides, weights
    and styling: as in `strands_now`; axes: (3, 3) by which points are multiplied; out: such an array to fill, None for
    a new one.
    """
    import warp as wp

    strand_count, device = len(binding.positions), binding.positions.device
    if out is None:
        there = kernels.parallel.empty_for_results((strand_count, guides.point_count), device)
        out = there.numpy()
    else:
        require_count("points", out.size, 3 * strand_count * guides.point_count)
        there = wp.array(out, dtype=wp.vec3, device="cpu", copy=False)

    is_under_way = threading.Event()

    def grow():
        if device.is_cpu:
            strands_now(binding, guides, weights, styling, there, is_under_way.set)
        else:
            made = strands_now(binding, guides, weights, styling)
            is_under_way.set()
            wp.copy(there, made)
            wp.synchronize_device(device)
        geometry.transform.transformed(out, axes, out)
        return out

    with_a_thread = ThreadPoolExecutor(1, "vellus")
    growing = with_a_thread.submit(grow)
    with_a_thread.shutdown(wait=False)  # its thread ends with its work
    growing.add_done_callback(lambda _done: is_under_way.set())  # after an error, too
    is_under_way.wait(PREPARATION)
    time.sleep(HEAD_START)
    return growing


def follow_some(
    binding: HairBinding,
    guides: Strands,
    chosen: np.ndarray,
    axes: np.ndarray = _AS_BOUND,
    styling: "Styling | None" = None,
) -> tuple[np.ndarray, np.ndarray]:
    """(M, P, 3) float32, the points that `growing_points` gives some strands, and (M, k) float32, their weights.

    No others are computed but the centres of their clumps. guides and styling: as in `strands_now`; chosen: (M,)
    indices of strands, such as `guide_weights.Reach` finds for the guides that moved.
    """
    read = [] if styling is None else styling.centres_of(chosen)
    levels = [] if styling is None else styling.levels
    centres = [(level.binding, rows) for level, rows in zip(levels, read, strict=True)]
    sums, weights = _sums_of_some([(binding, chosen), *centres], guides)
    if styling is not None:
        styling.apply(sums[0], list(zip(sums[1:], read, strict=True)), chosen)
    points = sums[0].numpy()
    return geometry.transform.transformed(points, axes, points), weights[: len(chosen)]


def weights_now(binding: HairBinding, guides: Strands) -> "GuideWeights":
    """The `GuideWeights` by which strands follow the guides as combed now."""
    _require_guides(binding, guides)
    guide_points = guides.points.to(binding.positions.device)
    return interpolation.guide_weights.limited(
        binding.guide_weights, guide_points, binding.guide_normals, binding.limits
    )


def _require_guides(binding, guides):
    if len(guides) != len(binding.guide_normals):
        raise HairError(
            f"The hair is bound to {len(binding.guide_normals)} guides, but there are {len(guides)}: bind it again."
        )


def _sums_of_some(parts, guides):
    """Weighted sums for some strands of bindings to the same guides by the same settings, all in one pass.

    parts: pairs of a binding and (M,) indices of its strands. Returns a list of (M, P) vec3, one of each part, and the
    weights of the guides of all, float32.
    """
    import warp as wp

    binding, rows_here = parts[0][0], interpolation.guide_weights.rows_here
    device = binding.positions.device
    _require_guides(binding, guides)
    for own, chosen in parts:
        require_indices("strands", chosen, len(own.positions))
        require_count("guides", own.guide_weights.guide_count, len(guides))

    def joined(array_of, kind):
        rows = [rows_here(array_of(own), chosen) for own, chosen in parts]
        return wp.array(np.concatenate(rows), dtype=kind, device=device, copy=False)

    # Few strands have no need of all guides.
    indices = np.concatenate([rows_here(own.guide_weights.indices, chosen) for own, chosen in parts])
    is_followed = np.zeros(len(guides) + 1, bool)
    is_followed[indices] = True
    is_followed[-1] = False  # where there is none, index -1
    followed, places = np.flatnonzero(is_followed), (np.cumsum(is_followed) - 1)[indices]
    places[indices < 0] = -1
    guide_points, guide_normals = (
        wp.array(rows_here(array, followed), dtype=wp.vec3, device=device, copy=False)
        for array in (guides.points, binding.guide_normals)
    )
    weights = interpolation.guide_weights.limited(
        interpolation.guide_weights.GuideWeights(
            wp.array(places, dtype=int, device=device),
            joined(lambda own: own.guide_weights.weights, float),
            joined(lambda own: own.guide_weights.turns, wp.vec2),
            len(followed),
        ),
        guide_points,
        guide_normals,
        binding.limits,
    )
    points = interpolation.interpolation.interpolate(
        joined(lambda own: own.positions, wp.vec3),
        joined(lambda own: own.normals, wp.vec3),
        guide_points,
        guide_normals,
        weights,
        binding.keep_length,
    )
    ends = np.cumsum([len(chosen) for _own, chosen in parts]).tolist()
    sums = [_rows_between(points, end - len(chosen), end) for end, (_own, chosen) in zip(ends, parts, strict=True)]
    return sums, weights.weights.numpy()


def _rows_between(points, first, end):
    """Some rows of a Warp array, which Warp itself gives if there are any."""
    import warp as wp

    none = wp.empty((0, points.shape[1]), dtype=wp.vec3, device=points.device)
    return points[first:end] if end > first else none
