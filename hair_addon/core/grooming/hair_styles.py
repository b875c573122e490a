# SPDX-License-Identifier: GPL-3.0-or-later
"""Styles bound to the strands of a hair: where clump sites stand, and what is kept while sliders move."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from .. import placement, styling
from ..geometry.mesh import SurfacePoints, TriMesh
from ..geometry.strands import Strands
from ..geometry.texture import Texture
from ..interpolation.hair_binding import HairBinding
from ..interpolation.regions import Regions
from ..interpolation.root_binder import RootBinder
from ..styling.base import StyleSettings
from ..styling.clump_trees import ClumpTrees
from ..styling.style_inputs import Inputs
from . import groom, groom_defaults
from .groom import HairSettings

if TYPE_CHECKING:
    from ..styling.stack import Styling

_ROUNDS = 2  # of relaxation: cells vary by 0.09, more evenly than locks do


def clump_trees(
    mesh: TriMesh,
    guide_roots: SurfacePoints,
    settings: HairSettings,
    *,
    density: np.ndarray | None = None,
    texture: Texture | None = None,
    regions: Sequence[Regions] = (),
    lines: np.ndarray | None = None,
    drawn_on: np.ndarray | None = None,
    shape: TriMesh | None = None,
    is_mirrored: bool = False,
    device: str = "cpu",
) -> ClumpTrees:
    """The `ClumpTrees` of hair, empty at first; arguments as in `groom.bind_hair`."""
    laid = groom.laid_lines(mesh, lines, drawn_on, device)
    binder = RootBinder(mesh, guide_roots, settings, regions, laid, is_mirrored, device)

    def place(count, seed):
        placed_on = mesh if shape is None else shape
        return placement.cvt.place(placed_on, count, seed, _ROUNDS, density=density, texture=texture, device=device)

    return ClumpTrees(binder, place, groom_defaults.grown_area(mesh, density, texture))


def bind_styles(
    binding: HairBinding,
    guides: Strands,
    settings: HairSettings,
    styles: Sequence[StyleSettings],
    trees: ClumpTrees,
    inputs: Inputs | None = None,
    axes: np.ndarray | None = None,
) -> "Styling | None":
    """The `Styling` of strands; None where strands follow the guides as they are.

    axes: (3, 3) rotation to the surface's own axes, None for none.
    """
    if not any(map(styling.base.has_effect, styles)) and settings.point_count == guides.point_count:
        return None
    inputs = Inputs() if inputs is None else inputs
    axes = np.eye(3) if axes is None else axes
    return styling.stack.bind(binding, guides, styles, inputs, trees, axes, settings.point_count)


def rotation_of(to_world_axes: np.ndarray) -> np.ndarray:
    """(3, 3): the nearest rotation from an object's axes and scale in the world, back to its own axes."""
    left, _scale, right = np.linalg.svd(np.asarray(to_world_axes, np.float64))
    return (left @ right).T
