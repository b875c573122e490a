# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands computed from their guides: all of them, in other threads, or some. Combing repeats this without a search.

Warp is imported late, because the import is slow.
"""

from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import replace
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

# Seconds for other threads to start their kernels, before this one takes the GIL again.
HEAD_START = 0.001

_AS_BOUND = np.eye(3)  # the axes of a binding itself


def strands_now(
    binding: HairBinding,
    guides: Strands,
    weights: "GuideWeights",
    styling: "Styling | None" = None,
    chosen: "wp.array[int] | None" = None,
    out: "wp.array2d[wp.vec3] | None" = None,
) -> "wp.array2d[wp.vec3]":
    """Return (M, P) vec3 [m] on the binding's device: strands for the guides as combed now. All updates call this.

    It computes the weighted sum, and applies styles to it.

    guides: as strands follow them, which are those of `Styling.guides` for styled strands; weights: from `weights_now`
    for the same strands and guides; chosen: (M,) int32 Warp array, their rows in `binding`, None for all; out: array to
    fill and return, None for a new one.
    """
    points = _weighted_sum(binding, guides, weights, chosen, out)
    if styling is not None:
        styling.apply(points, lambda other, some: _some_now(other, guides, some), chosen)
    return points


def _some_now(binding, guides, chosen):
    """(M, P) vec3: strands without styles, all or (M,) indices of some."""
    rows = None if chosen is None else _rows(binding, chosen)
    return _weighted_sum(binding, guides, weights_now(binding, guides, chosen), rows)


def _weighted_sum(binding, guides, weights, chosen=None, out=None):
    roots, normals = binding.positions, binding.normals
    if chosen is not None:
        roots, normals = (interpolation.guide_weights.rows(array, chosen) for array in (roots, normals))
    weights, guide_points, guide_normals = _followed(binding, guides, weights)
    return interpolation.interpolation.interpolate(
        roots, normals, guide_points, guide_normals, weights, binding.keep_length, out
    )


def combed(guides: Strands, before: Strands) -> np.ndarray | None:
    """Indices (M,) of guides that were combed since; None where they are others, or rooted elsewhere."""
    has_same_roots = guides.roots is before.roots or guides.roots.is_same(before.roots)
    if guides.points.shape != before.points.shape or not has_same_roots:
        return None
    return np.flatnonzero((guides.numpy() != before.numpy()).any(axis=(1, 2)))


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

    def grow():
        if device.is_cpu:
            strands_now(binding, guides, weights, styling, out=there)
        else:
            wp.copy(there, strands_now(binding, guides, weights, styling))
            wp.synchronize_device(device)
        geometry.transform.transformed(out, axes, out)
        return out

    with_a_thread = ThreadPoolExecutor(1, "vellus")
    growing = with_a_thread.submit(grow)
    with_a_thread.shutdown(wait=False)  # its thread ends with its work
    wait([growing], timeout=HEAD_START)
    return growing


def follow_some(
    binding: HairBinding,
    guides: Strands,
    chosen: np.ndarray,
    weights: "GuideWeights",
    axes: np.ndarray = _AS_BOUND,
    styling: "Styling | None" = None,
) -> np.ndarray:
    """(M, P, 3) float32: the points that `growing_points` gives some strands, and no others are computed.

    chosen: (M,) indices of strands, such as `guide_weights.Reach` finds for the guides that moved; weights: theirs, as
    `weights_now` gives them.
    """
    points = strands_now(binding, guides, weights, styling, _rows(binding, chosen)).numpy()
    return geometry.transform.transformed(points, axes, points)


def weights_now(binding: HairBinding, guides: Strands, chosen: np.ndarray | None = None) -> "GuideWeights":
    """The `GuideWeights` by which strands follow the guides as combed now; chosen: (M,) indices of some, None: all."""
    if len(guides) != len(binding.guide_normals):
        raise HairError(
            f"The hair is bound to {len(binding.guide_normals)} guides, but there are {len(guides)}: bind it again."
        )
    weights = binding.guide_weights
    if chosen is not None:
        weights = weights.of(_rows(binding, chosen))
    now = interpolation.guide_weights.limited(*_followed(binding, guides, weights), binding.limits)
    return replace(weights, weights=now.weights)


def _rows(binding, chosen):
    """Indices of some strands, (M,), on the binding's device."""
    import warp as wp

    require_indices("strands", chosen, len(binding.positions))
    return wp.array(chosen, dtype=int, device=binding.positions.device)


def _followed(binding, guides, weights):
    """`GuideWeights`, points and normals of the guides that strands follow: few strands have no need of all guides."""
    import warp as wp

    # A kernel given memory of another device reads garbage, or causes an error that affects its whole device.
    points, normals = guides.points.to(binding.positions.device), binding.guide_normals
    if weights.indices.size > len(normals):
        return weights, points, normals
    indices = weights.indices.numpy()
    followed, places = np.unique(np.append(-1, indices), return_inverse=True)
    places = wp.array((places[1:] - 1).reshape(indices.shape), dtype=int, device=normals.device)
    followed = wp.array(followed[1:], dtype=int, device=normals.device)
    weights = replace(weights, indices=places, guide_count=len(followed))
    return (
        weights,
        interpolation.guide_weights.rows(points, followed),
        interpolation.guide_weights.rows(normals, followed),
    )
