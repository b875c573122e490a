# SPDX-License-Identifier: GPL-3.0-or-later
"""What ties hair to its guides, and the strands that follow: no search here, this is what combing and sliders repeat.

Warp takes long to import, so it is imported late.
"""

from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import dataclass, replace

import numpy as np

from .errors import HairError
from .mesh import SurfacePoints, positions
from .strands import Strands

# Seconds in which other threads start their kernels, before this one takes Python's lock again and keeps it.
HEAD_START = 0.001


@dataclass(frozen=True)
class HairBinding:
    """What ties hair to a surface and its guides, and does not change while guides are combed."""

    roots: SurfacePoints
    positions: "wp.array[wp.vec3]"  # noqa: F821 (S,) [m]
    normals: "wp.array[wp.vec3]"  # noqa: F821 (S,) unit
    guide_normals: "wp.array[wp.vec3]"  # noqa: F821 (G,) unit, at the guides' roots
    candidates: "guide_weights.Candidates"  # noqa: F821 (S, k + 1)
    guide_weights: "guide_weights.GuideWeights"  # noqa: F821 (S, k), before guides that differ are left out
    limits: "guide_weights.Limits"  # noqa: F821
    keep_length: float


def weighed(roots, root_positions, root_normals, guide_normals, candidates, settings):
    """The `HairBinding` of strands that have found their guides."""
    from . import guide_weights

    return HairBinding(
        roots,
        root_positions,
        root_normals,
        guide_normals,
        candidates,
        guide_weights.weigh(
            candidates,
            root_normals,
            guide_normals,
            None if settings.automatic_influence else settings.influence_distance,
            settings.neighbour_limit,
        ),
        guide_weights.Limits(settings.angle_limit, settings.length_limit),
        settings.keep_length,
    )


def weigh_again(binding, settings):
    """A `HairBinding` with other weights, limits or lengths: no search. For at most as many guides as were found."""
    places = binding.roots, binding.positions, binding.normals, binding.guide_normals
    return weighed(*places, binding.candidates, settings)


def follow_guides(binding, guides) -> Strands:
    """Strands of a binding for the guides as they are combed now: no search."""
    weights = weights_now(binding, guides)
    return Strands(_follow(binding, guides, binding.positions, binding.normals, weights), binding.roots)


def growing_points(binding, guides, weights, finish=lambda _points: None, out=None):
    """A future of the points of `follow_guides`, (S, P, 3) float32 [m] in the processor's memory, and then finished.

    They are computed in other threads, so that this one can do what it has to do with something else. weights: what
    `weights_now` gives; finish: what to do with such an array, in its own memory; out: one to fill, None for a new one.
    """
    import warp as wp

    from . import cores

    roots, normals, device = binding.positions, binding.normals, binding.positions.device
    if out is None:
        there = cores.empty_for_results((len(roots), guides.point_count), device)
        out = there.numpy()
    else:
        there = wp.array(out, dtype=wp.vec3, device="cpu", copy=False)

    def grow():
        if device.is_cpu:
            _follow(binding, guides, roots, normals, weights, there)
        else:
            wp.copy(there, _follow(binding, guides, roots, normals, weights))
            wp.synchronize_device(device)
        finish(out)
        return out

    with_a_thread = ThreadPoolExecutor(1, "vellus")
    growing = with_a_thread.submit(grow)
    with_a_thread.shutdown(wait=False)  # its thread ends with its work
    wait([growing], timeout=HEAD_START)
    return growing


def follow_some(binding, guides, chosen, weights):
    """(M, P, 3) float32 [m]: the points that `growing_points` gives some strands, and no others are computed.

    chosen: (M,) indices of strands, such as `guide_weights.Reach` finds for the guides that moved; weights: theirs, as
    `weights_now` gives them.
    """
    import warp as wp

    from .guide_weights import rows

    chosen = wp.array(chosen, dtype=int, device=binding.positions.device)
    return _follow(binding, guides, rows(binding.positions, chosen), rows(binding.normals, chosen), weights).numpy()


def weights_now(binding, guides, chosen=None):
    """The `GuideWeights` by which strands follow the guides as combed now; chosen: (M,) indices of some, None: all."""
    import warp as wp

    from . import guide_weights

    if len(guides) != len(binding.guide_normals):
        raise HairError(
            f"The hair was bound to {len(binding.guide_normals)} guides and there are {len(guides)} now: bind it again."
        )
    weights = binding.guide_weights
    if chosen is not None:
        weights = weights.of(wp.array(chosen, dtype=int, device=binding.positions.device))
    now = guide_weights.limited(*_followed(binding, guides, weights), binding.limits)
    return replace(weights, weights=now.weights)


def _guide_points(binding, guides):
    # A kernel that is handed memory of another device reads rubbish, or ends all work on its own.
    return guides.points.to(binding.positions.device)


def _followed(binding, guides, weights):
    """`GuideWeights`, points and normals of the guides that strands follow: few strands have no need of all guides."""
    import warp as wp

    from .guide_weights import rows

    points, normals = _guide_points(binding, guides), binding.guide_normals
    if weights.indices.size > len(normals):
        return weights, points, normals
    indices = weights.indices.numpy()
    followed, places = np.unique(np.append(-1, indices), return_inverse=True)
    places = wp.array((places[1:] - 1).reshape(indices.shape), dtype=int, device=normals.device)
    followed = wp.array(followed[1:], dtype=int, device=normals.device)
    return replace(weights, indices=places), rows(points, followed), rows(normals, followed)


def _follow(binding, guides, roots, root_normals, weights, out=None):
    from . import interpolation

    weights, points, normals = _followed(binding, guides, weights)
    return interpolation.interpolate(roots, root_normals, points, normals, weights, binding.keep_length, out)


def leading_strands(mesh, guides, binding):
    """(S,) int32: the strand of a `HairBinding` that stands for the guide that each follows first."""
    from . import leaders

    first = binding.guide_weights.indices.numpy()[:, 0]
    return leaders.leaders(first, binding.positions.numpy(), positions(mesh, guides.roots))
