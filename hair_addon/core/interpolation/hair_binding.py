# SPDX-License-Identifier: GPL-3.0-or-later
"""What ties hair to its guides: where strands are rooted, whom each follows, and what it is known by.

Warp is imported late, because the import is slow.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import geometry, interpolation
from ..geometry.mesh import SurfacePoints

if TYPE_CHECKING:
    import warp as wp

    from .guide_weights import Candidates, GuideWeights, Limits


@dataclass(frozen=True)
class HairBinding:
    """Binding of hair to a surface and its guides, which combing does not change.

    The sum over guides and what follows it (grooming/following.py) know of strands what stands here.
    """

    roots: SurfacePoints
    positions: "wp.array[wp.vec3]"  # (S,) [m]
    normals: "wp.array[wp.vec3]"  # (S,) unit: the frames of roots follow from them (`guide_weights.frame`)
    guide_positions: np.ndarray  # (G, 3) float32 [m], of the guides' roots
    guide_normals: "wp.array[wp.vec3]"  # (G,) unit, at the guides' roots
    candidates: "Candidates"  # (S, k + 1)
    guide_weights: "GuideWeights"  # (S, k), before guides that differ are left out
    limits: "Limits"
    keep_length: float
    is_mirrored: bool = False  # whether triangles are wound the other way than where roots are stored

    @cached_property
    def identities(self) -> tuple[np.ndarray, np.ndarray]:
        """(S,) int32 and (S,) float32 in [0, 1): what strands are known by, and differ by, whichever others there are.

        They follow from a strand's root alone: neither another number of strands nor an update of some changes them.
        """
        return geometry.root_frames.identities(self.roots, self.is_mirrored)

    @cached_property
    def leaders(self) -> np.ndarray:
        """(S,) int32: the strand nearest to the first guide of each."""
        first = self.guide_weights.indices.numpy()[:, 0]
        return interpolation.clump_centers.clump_centers(first, self.positions.numpy(), self.guide_positions)


def weighed(
    roots: SurfacePoints,
    root_frames: tuple["wp.array[wp.vec3]", "wp.array[wp.vec3]"],
    guide_frames: tuple[np.ndarray, "wp.array[wp.vec3]"],
    candidates: "Candidates",
    settings: Any,
    is_mirrored: bool = False,
) -> HairBinding:
    """The `HairBinding` of strands that have found their guides.

    root_frames: positions (S,) [m] and unit normals (S,), vec3; guide_frames: positions (G, 3) float32 [m] and unit
    normals (G,) vec3; settings: `HairSettings`.
    """
    return HairBinding(
        roots,
        *root_frames,
        *guide_frames,
        candidates,
        interpolation.guide_weights.weigh(
            candidates,
            root_frames[1],
            guide_frames[1],
            None if settings.automatic_influence else settings.influence_distance,
            settings.neighbour_limit,
        ),
        interpolation.guide_weights.Limits(settings.angle_limit, settings.length_limit),
        settings.keep_length,
        is_mirrored,
    )


def limited_again(binding: HairBinding, settings: Any) -> HairBinding:
    """A `HairBinding` with the same weights and other limits or lengths; settings: `HairSettings`."""
    limits = interpolation.guide_weights.Limits(settings.angle_limit, settings.length_limit)
    return replace(binding, limits=limits, keep_length=settings.keep_length)


def weigh_again(binding: HairBinding, settings: Any) -> HairBinding:
    """A `HairBinding` with other weights, limits or lengths: no search. For at most as many guides as were found."""
    at_roots, at_guides = (binding.positions, binding.normals), (binding.guide_positions, binding.guide_normals)
    return weighed(binding.roots, at_roots, at_guides, binding.candidates, settings, binding.is_mirrored)
