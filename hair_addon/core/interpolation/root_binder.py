# SPDX-License-Identifier: GPL-3.0-or-later
"""Binding of roots on one surface to its guides, and search among roots, within regions and beside part lines."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import geometry, interpolation
from ..geometry.mesh import SurfacePoints, TriMesh, positions
from ..kernels.checks import require_indices
from .hair_binding import HairBinding, weighed
from .regions import Regions

if TYPE_CHECKING:
    from .part_lines import PartLines

CENTRES = 6  # searched centers, as the nearest may be on another face


@dataclass(frozen=True)
class RootBinder:
    """A surface with guides, to which strands are bound.

    mesh: `TriMesh` [m]; settings: `HairSettings`; regions: strands blend only guides of one region; lines: `PartLines`
    that strands do not blend guides across, or None; is_mirrored: whether the winding of triangles is opposite to that
    of the stored roots; tie_fractions: (G,) as in `interpolation.interpolate`.
    """

    mesh: TriMesh
    guide_roots: SurfacePoints
    settings: Any
    regions: Sequence[Regions] = ()
    lines: "PartLines | None" = None
    is_mirrored: bool = False
    device: str = "cpu"
    tie_fractions: np.ndarray | None = None

    def bind(self, roots: SurfacePoints) -> HairBinding:
        """Return the `HairBinding` of strands at roots."""
        guide_positions, guide_normals = self._guide_frames
        root_positions, root_normals = geometry.root_frames.rooted(self.mesh, roots, self.device)
        candidates = interpolation.guide_weights.find_candidates(
            root_positions,
            root_normals,
            guide_positions,
            guide_normals,
            self.settings.neighbour_limit,
            regions=interpolation.regions.region_labels(self.regions, roots, self.guide_roots),
            lines=self.lines,
        )
        at_roots, at_guides = (root_positions, root_normals), (positions(self.mesh, self.guide_roots), guide_normals)
        return self._weighed(roots, at_roots, at_guides, candidates)

    def bind_guides(self, chosen: np.ndarray) -> HairBinding:
        """Return the `HairBinding` of strands at the roots of guides (K,) int32; each follows its own guide alone.

        Raises `HairError` for guides that do not exist.
        """
        require_indices("guides", chosen, len(self.guide_roots))
        require_indices("guides", chosen, len(self.guide_roots))
        roots = self.guide_roots[chosen]
        at_roots = geometry.root_frames.rooted(self.mesh, roots, self.device)
        at_guides = positions(self.mesh, self.guide_roots), self._guide_frames[1]
        candidates = interpolation.guide_weights.only_candidates(
            chosen, len(self.guide_roots), self.settings.neighbour_limit, self.device
        )
        return self._weighed(roots, at_roots, at_guides, candidates)

    def nearest(self, strands: HairBinding, centres: HairBinding) -> np.ndarray:
        """Return (S, 2) int32: the two centers nearest to each strand, -1 if there are fewer than two.

        These centers are in the strand's region, on its side of part lines and, at sharp edges, on its face.
        """
        regions = self._with_guide_regions(strands, centres)
        found = interpolation.guide_weights.find_candidates(
            strands.positions,
            strands.normals,
            centres.positions,
            centres.normals,
            CENTRES - 1,
            regions=regions,
            lines=self.lines,
        )
        nearest = found.indices.numpy()[:, :2].copy()
        if regions is not None:
            of_strands, of_centres = regions
            nearest[(nearest >= 0) & (of_centres[nearest] != of_strands[:, None])] = -1
        return nearest

    def with_settings(self, settings: Any) -> "RootBinder":
        """Return a copy with other `HairSettings`."""
        return replace(self, settings=settings)

    def _weighed(self, roots, at_roots, at_guides, candidates):
        import warp as wp

        tie_fractions = self.tie_fractions
        if tie_fractions is not None:
            tie_fractions = wp.array(np.float32(tie_fractions), dtype=float, device=self.device)
        return weighed(roots, at_roots, at_guides, candidates, self.settings, self.is_mirrored, tie_fractions)

    @cached_property
    def _guide_frames(self):
        return geometry.root_frames.rooted(self.mesh, self.guide_roots, self.device)

    def _with_guide_regions(self, strands, centres):
        """Return the regions (S,) and (K,) of the first guides of strands and centers; None without regions."""
        region_labels = interpolation.regions.region_labels(self.regions, self.guide_roots, self.guide_roots)
        if region_labels is None:
            return None
        of_guides = region_labels[1]
        first_guides = (binding.guide_weights.indices.numpy()[:, 0] for binding in (strands, centres))
        of_strands, of_centres = (of_guides[guides] for guides in first_guides)
        return of_strands, of_centres
