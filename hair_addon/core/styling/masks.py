# SPDX-License-Identifier: GPL-3.0-or-later
"""Inputs of styles: masks, which are weights at roots that multiply the amount of a style; planes, directions, maps."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from ..geometry.faces.uv_maps import Texture
from ..geometry.mesh import SurfacePoints
from ..interpolation.hair_binding import HairBinding
from ..kernels.checks import require_count, require_indices
from .base import Cutter
from .courses import Courses
from .varied_numbers import NumberMap


@dataclass(frozen=True)
class Mask:
    """Weights of a surface and of guides, which are multiplied; each may be None.

    corners: (F, 3) float32 at the corners of triangles; texture: `Texture`; guides: (G,) float32, which strands blend
    with the weights of their guides.
    """

    corners: np.ndarray | None = None
    texture: Texture | None = None
    guides: np.ndarray | None = None
    is_inverted: bool = False

    def of_strands(self, binding: HairBinding, _clumps: np.ndarray | None = None) -> np.ndarray:
        """Return (S,) float32 in [0, 1] of bound strands; their clumps are not used."""
        weights = self._on_surface(binding.roots)
        if self.guides is not None:
            indices, shares = binding.guide_weights.indices.numpy(), binding.guide_weights.weights.numpy()
            require_indices("guides", indices[indices >= 0], len(self.guides))
            mixed = np.where(indices >= 0, self.guides[np.maximum(indices, 0)] * shares, 0.0)
            weights = weights * mixed.sum(axis=1)
        return self._finished(weights)

    def of_guides(self, roots: SurfacePoints) -> np.ndarray:
        """Return (G,) float32 in [0, 1] of guides rooted at `SurfacePoints`."""
        weights = self._on_surface(roots)
        if self.guides is not None:
            require_count("guides", len(self.guides), len(roots))
            weights = weights * self.guides
        return self._finished(weights)

    def _on_surface(self, roots):
        weights = np.ones(len(roots))
        if self.corners is not None:
            require_indices("triangles", roots.triangle, len(self.corners))
            weights = weights * np.einsum("nc,nc->n", self.corners[roots.triangle], roots.barycentric)
        if self.texture is not None:
            weights = weights * self.texture.at(roots)
        return weights

    def _finished(self, weights):
        weights = np.clip(np.where(np.isfinite(weights), weights, 0.0), 0.0, 1.0)
        return (1.0 - weights if self.is_inverted else weights).astype(np.float32)


@dataclass(frozen=True, eq=False)
class CutMask:
    """The part of its length that each strand loses.

    length: the fraction of its length that a strand keeps; read: a function of a `HairBinding` and the clumps (S,)
    int32 of its strands, None if unknown, that returns the fraction (S,) that each keeps; None for `length`.
    """

    length: float
    read: Callable[[HairBinding, np.ndarray | None], np.ndarray] | None = None

    def of_strands(self, binding: HairBinding, clumps: np.ndarray | None = None) -> np.ndarray:
        """Return (S,) float32 in [0, 1] of bound strands; clumps: (S,) int32, None if unknown."""
        if self.read is None:
            return np.full(len(binding.roots), 1.0 - self.length, np.float32)
        return (1.0 - np.clip(self.read(binding, clumps), 0.0, 1.0)).astype(np.float32)

    def of_guides(self, roots: SurfacePoints) -> np.ndarray:
        """Return (G,) float32 zeros: guides keep their length."""
        return np.zeros(len(roots), np.float32)


@dataclass(frozen=True)
class Inputs:
    """Masks by `program.mask_key`; planes of cutters and directions of targets by the names of objects.

    numbers: values that differ between strands, by (index of the style, name of its setting);
    courses: curves from root to tip of numbers, by the same keys;
    guide_sets: (G,) bool, the guides of selections at the centers of locks, by the names of selections.
    """

    masks: Mapping[tuple[str, str, bool], Mask | CutMask] = field(default_factory=dict)
    cutters: Mapping[str, Cutter] = field(default_factory=dict)
    targets: Mapping[str, np.ndarray] = field(default_factory=dict)
    numbers: Mapping[tuple[int, str], NumberMap] = field(default_factory=dict)
    courses: Courses = field(default_factory=dict)
    guide_sets: Mapping[str, np.ndarray] = field(default_factory=dict)
