# SPDX-License-Identifier: GPL-3.0-or-later
"""Binding of hair to its guides: roots, guide indices and weights, and IDs of strands.

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

# Maximum movement of a strand's points by its turn relative to its guides, as a part of their mean distance.
SPREAD = 0.25


@dataclass(frozen=True)
class HairBinding:
    """Binding of hair to a surface and its guides, which combing does not change.

    The weighted sum and the later stages (grooming/following.py) need nothing else of strands.
    """

    roots: SurfacePoints
    positions: "wp.array[wp.vec3]"  # (S,) [m]
    normals: "wp.array[wp.vec3]"  # (S,) unit; they define the frames of roots (`guide_weights.frame`)
    guide_positions: np.ndarray  # (G, 3) float32 [m], of the guides' roots
    guide_normals: "wp.array[wp.vec3]"  # (G,) unit, at the guides' roots
    candidates: "Candidates"  # (S, k + 1)
    guide_weights: "GuideWeights"  # (S, k), before limits on differences of shape
    limits: "Limits"
    keep_length: float
    is_mirrored: bool = False  # whether the winding of triangles is opposite to that of the stored roots
    tie_fractions: "wp.array[float] | None" = None  # (G,) as in `interpolation.interpolate`

    @cached_property
    def identities(self) -> tuple[np.ndarray, np.ndarray]:
        """(S,) int32 IDs and (S,) float32 random numbers in [0, 1) of strands.

        They depend only on a strand's root, not on the number or on updates of other strands.
        """
        return geometry.root_frames.identities(self.roots, self.is_mirrored)

    @cached_property
    def leaders(self) -> np.ndarray:
        """(S,) int32: for each strand, the strand nearest to its first guide."""
        first = self.guide_weights.indices.numpy()[:, 0]
        return interpolation.clump_centers.clump_centers(first, self.positions.numpy(), self.guide_positions)


def weighed(
    roots: SurfacePoints,
    root_frames: tuple["wp.array[wp.vec3]", "wp.array[wp.vec3]"],
    guide_frames: tuple[np.ndarray, "wp.array[wp.vec3]"],
    candidates: "Candidates",
    settings: Any,
    is_mirrored: bool = False,
    tie_fractions: "wp.array[float] | None" = None,
) -> HairBinding:
    """Return the `HairBinding` of strands with `Candidates`.

    root_frames: positions (S,) [m] and unit normals (S,), vec3; guide_frames: positions (G, 3) float32 [m] and unit
    normals (G,) vec3; settings: `HairSettings`; tie_fractions: (G,) as in `interpolation.interpolate`.
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
        tie_fractions,
    )


def relimited(binding: HairBinding, settings: Any) -> HairBinding:
    """Return a `HairBinding` with the same weights and other limits or lengths; settings: `HairSettings`."""
    limits = interpolation.guide_weights.Limits(settings.angle_limit, settings.length_limit)
    return replace(binding, limits=limits, keep_length=settings.keep_length)


def reweighed(binding: HairBinding, settings: Any) -> HairBinding:
    """Return a `HairBinding` with other weights, limits or lengths, without a search; k must not grow."""
    at_roots, at_guides = (binding.positions, binding.normals), (binding.guide_positions, binding.guide_normals)
    kept = binding.is_mirrored, binding.tie_fractions
    return weighed(binding.roots, at_roots, at_guides, binding.candidates, settings, *kept)
