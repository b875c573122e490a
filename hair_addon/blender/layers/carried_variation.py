# SPDX-License-Identifier: GPL-3.0-or-later
"""Random variation of guides with layers, which stays in place on the surface when the number of guides changes.

Growth draws random lengths and tilts by the index of a guide. With another number of guides, all would be new,
and hair would change although its combing did not. So guides remember the roots from which their variation comes.
"""

from dataclasses import dataclass

import numpy as np
from bpy.types import Curves

from ...core import geometry, grooming
from ...core.geometry import mesh as mesh_math
from ...core.geometry import strands
from ...core.geometry.mesh import SurfacePoints
from ..data.strands import layer_attributes
from ..data.surfaces import Surface
from . import carried_layers
from .carried_layers import LayersBefore

# Custom property of guides: {"seed": int, "roots": flat (G, 3) places in the bounding box, absent for their own roots}.
_NAME = "vellus_variation"
_SAME = 1e-4  # largest distance of roots that count as the same, relative to the surface's extent


@dataclass(frozen=True)
class CarriedVariation:
    """Variation of a seed at roots (G, 3), relative to the bounding box of a surface in local coordinates.

    These stay where the surface is moved, turned or scaled.
    """

    surface: Surface
    before: LayersBefore
    seed: int
    roots: np.ndarray

    def at(self, roots: SurfacePoints) -> np.ndarray | None:
        """Return the random numbers (M, 3) of guides at M roots; None for those of the seed, at the same roots."""
        if self.is_at(roots):
            return None
        mesh = self.surface.mesh
        low, size = _box(self.surface)
        own = geometry.closest_point.SurfaceQuery(mesh).nearest(self.surface.from_local(low + size * self.roots))
        places = np.stack([mesh_math.positions(mesh, own)] * 2, axis=1)
        binding = carried_layers.binding_of(
            self.surface, self.before, roots, strands.from_numpy(places.astype(np.float32), own, "cpu")
        )
        weights = binding.guide_weights
        numbers = grooming.guide_growth.random_numbers(self.seed, len(self.roots))
        return grooming.guide_growth.carried(numbers, weights.indices.numpy(), weights.weights.numpy())

    def is_at(self, roots: SurfacePoints) -> bool:
        """Whether roots are those from which the variation comes."""
        if len(roots) != len(self.roots):
            return False
        apart = _relative(self.surface, roots) - self.roots
        return bool(np.abs(apart).max(initial=0.0) <= _SAME)


def read(guides: Curves | None, surface: Surface, seed: int) -> CarriedVariation | None:
    """Return the `CarriedVariation` of guides on a `Surface`; None without layers, and for guides of another seed."""
    if guides is None or not guides.vellus.is_base_grown or not layer_attributes.has_base(guides):
        return None
    before = carried_layers.read(guides, surface)
    if before is None:
        return None
    stored = guides.get(_NAME)
    try:
        if stored is not None and stored["seed"] != seed:
            return None
        if stored is None or "roots" not in stored:
            roots = _relative(surface, before.guides.roots)
        else:
            roots = np.array(stored["roots"], np.float64).reshape(-1, 3)
    except (KeyError, TypeError, ValueError, IndexError):  # of a damaged file
        return None
    return CarriedVariation(surface, before, seed, roots) if len(roots) and np.isfinite(roots).all() else None


def write(guides: Curves, variation: CarriedVariation | None, roots: SurfacePoints, seed: int) -> None:
    """Remember the seed of guides grown at `roots`, and the roots that their variation comes from; None for `roots`."""
    if variation is not None and not variation.is_at(roots):
        guides[_NAME] = {"seed": seed, "roots": variation.roots.ravel().tolist()}
    else:
        guides[_NAME] = {"seed": seed}


def _relative(surface, roots):
    low, size = _box(surface)
    return (surface.to_local(mesh_math.positions(surface.mesh, roots)[:, None])[:, 0] - low) / size


def _box(surface):
    """Return the lowest corner (3,) and the largest side of a surface's bounding box, in local coordinates."""
    vertices = surface.local_mesh.vertices
    low = vertices.min(axis=0).astype(np.float64)
    return low, float((vertices.max(axis=0) - low).max())
