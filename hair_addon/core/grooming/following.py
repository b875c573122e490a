# SPDX-License-Identifier: GPL-3.0-or-later
"""Evaluation of all strands from their guides, in other threads, or of some strands. Combing repeats only this.

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
from ..kernels.checks import require_count

if TYPE_CHECKING:
    import warp as wp

    from ..interpolation.guide_weights import GuideWeights
    from ..styling.stack import Styling

# Maximum time for other threads to prepare their kernels, and time to start them [s], before this thread takes the GIL
# again, which it may hold for longer than the kernels run.
PREPARATION, HEAD_START = 0.02, 0.0005

_AS_BOUND = np.eye(3)  # the binding's own axes


def strands_now(
    binding: HairBinding,
    guides: Strands,
    weights: "GuideWeights",
    styling: "Styling | None" = None,
    out: "wp.array2d[wp.vec3] | None" = None,
    under_way: Callable[[], None] | None = None,
) -> "wp.array2d[wp.vec3]":
    """Return strands (S, P) vec3 [m] on the binding's device for the present guides: weighted sums, then styles.

    `follow_some` does the same for some of the strands.

    guides: from `Styling.guides` for styled strands; weights: from `weights_now` for the same guides; out: array to
    fill and return, None for a new one; under_way: called when the kernels of the weighted sums run.
    """
    points = _weighted_sum(binding, guides, weights, out, under_way)
    if styling is None:
        return points
    of_levels = [level.binding for level in styling.levels]
    if styling.used_centres is None:
        styling.apply(points, [(_weighted_sum(own, guides, weights_now(own, guides)), None) for own in of_levels])
    else:
        used = styling.used_centres
        sums, _weights = _sums_of_some(list(zip(of_levels, used, strict=True)), guides)
        styling.apply(points, list(zip(sums, used, strict=True)))
    return points


def _weighted_sum(binding, guides, weights, out=None, under_way=None):
    # Memory of another device would give wrong results, or an error that affects the whole device.
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
        tie_fractions=binding.tie_fractions,
    )


def combed(guides: Strands, before: Strands) -> np.ndarray | None:
    """Return the indices (M,) of guides that changed since `before`; None if counts or roots differ."""
    has_same_roots = guides.roots is before.roots or guides.roots.is_same(before.roots)
    if guides.points.shape != before.points.shape or not has_same_roots:
        return None
    is_other = guides.numpy() != before.numpy()
    if np.count_nonzero(is_other) > len(is_other):
        return np.flatnonzero(is_other.any(axis=(1, 2)))
    return np.unique(np.flatnonzero(is_other) // is_other[0].size)  # takes half as long if few guides changed


def follow_guides(binding: HairBinding, guides: Strands, styling: "Styling | None" = None) -> Strands:
    """Return the strands of a binding for the present guides, with styles."""
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
    """Return a future of the points of `follow_guides`, (S, P, 3) float32 in CPU memory.

    They are computed in other threads. guides, weights and styling: as in `strands_now`; axes: (3, 3) matrix by which
    points are multiplied; out: array to fill, None for a new one.
    """
    import warp as wp

    strand_count, device = len(binding.positions), binding.positions.device
    if out is None:
        result = kernels.parallel.empty_for_results((strand_count, guides.point_count), device)
        out = result.numpy()
    else:
        require_count("points", out.size, 3 * strand_count * guides.point_count)
        result = wp.array(out, dtype=wp.vec3, device="cpu", copy=False)

    is_under_way = threading.Event()

    def grow():
        if device.is_cpu:
            strands_now(binding, guides, weights, styling, result, is_under_way.set)
        else:
            on_device = strands_now(binding, guides, weights, styling)
            is_under_way.set()
            wp.copy(result, on_device)
            wp.synchronize_device(device)
        geometry.transform.transformed(out, axes, out)
        return out

    executor = ThreadPoolExecutor(1, "vellus")
    growing = executor.submit(grow)
    executor.shutdown(wait=False)  # the thread ends with its work
    growing.add_done_callback(lambda _done: is_under_way.set())  # after an error too
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
    """Return points (M, P, 3) float32 of some strands, like `growing_points`, and their weights (M, k) float32.

    Only these strands and the centers of their clumps are computed. guides and styling: as in `strands_now`; chosen:
    (M,) indices of strands, for example from `guide_weights.Reach` for moved guides.
    """
    read = [] if styling is None else styling.centres_of(chosen)
    levels = [] if styling is None else styling.levels
    centres = [(level.binding, rows) for level, rows in zip(levels, read, strict=True)]
    sums, weights = _sums_of_some([(binding, chosen), *centres], guides)
    if styling is not None:
        styling.apply(sums[0], list(zip(sums[1:], read, strict=True)), chosen)
    points = sums[0].numpy()
    return geometry.transform.transformed(points, axes, points), weights[0].numpy()


def weights_now(binding: HairBinding, guides: Strands) -> "GuideWeights":
    """Return the `GuideWeights` of strands for the present guides."""
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
    """Compute weighted sums for some strands of several bindings to the same guides and settings.

    parts: pairs of a binding and (M,) indices of its strands. Returns lists of the strands (M, P) vec3, and of the
    guide weights (M, k) of each part.
    """
    binding = parts[0][0]
    device = binding.positions.device
    _require_guides(binding, guides)
    guide_points, sums, of_all = guides.points.to(device), [], []
    for own, strands in parts:
        require_count("guides", own.guide_weights.guide_count, len(guides))
        chosen = interpolation.guide_weights.chosen_strands(own.guide_weights, strands)
        weights = interpolation.guide_weights.limited(
            own.guide_weights, guide_points, binding.guide_normals, binding.limits, chosen
        )
        sums.append(
            interpolation.interpolation.interpolate(
                own.positions,
                own.normals,
                guide_points,
                binding.guide_normals,
                weights,
                binding.keep_length,
                chosen=chosen,
                tie_fractions=binding.tie_fractions,
            )
        )
        of_all.append(weights.weights)
    return sums, of_all
