# SPDX-License-Identifier: GPL-3.0-or-later
"""Binding of styles to the strands of a hair, with the placement of clump sites."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from .. import placement, styling
from ..geometry.faces.uv_maps import Texture
from ..geometry.mesh import SurfacePoints, TriMesh
from ..geometry.strands import Strands
from ..interpolation.hair_binding import HairBinding
from ..interpolation.regions import Regions
from ..interpolation.root_binder import RootBinder
from ..long_work import Progress, no_progress
from ..styling.base import StyleSettings
from ..styling.clump_trees import ClumpTrees
from ..styling.masks import CutMask, Inputs
from . import groom, groom_defaults
from .groom import HairSettings

if TYPE_CHECKING:
    from ..styling.stack import Styling

_ROUNDS = 2  # of relaxation: sizes of cells vary by 0.09, less than sizes of real locks


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
    tie_fractions: np.ndarray | None = None,
    device: str = "cpu",
) -> ClumpTrees:
    """Return the `ClumpTrees` of hair, initially empty; arguments as in `groom.bind_hair`."""
    laid = groom.laid_lines(mesh, lines, drawn_on, device)
    binder = RootBinder(mesh, guide_roots, settings, regions, laid, is_mirrored, device, tie_fractions)

    placed_on, its_texture = mesh if shape is None else shape, texture
    if is_mirrored:  # like stored roots, so that sites are the same on a mirrored surface
        placed_on = TriMesh(-placed_on.vertices, placed_on.triangles[:, [0, 2, 1]])
        its_texture = None if texture is None else texture.with_flipped_winding()

    def place(count, seed, progress):
        found = placement.cvt.place(
            placed_on,
            count,
            seed,
            _ROUNDS,
            density=density,
            texture=its_texture,
            device=device,
            progress=lambda part: progress("Placing locks", part),
        )
        return found.with_flipped_winding() if is_mirrored else found

    return ClumpTrees(binder, place, groom_defaults.grown_area(mesh, density, texture))


def bind_styles(
    binding: HairBinding,
    guides: Strands,
    settings: HairSettings,
    styles: Sequence[StyleSettings],
    trees: ClumpTrees,
    inputs: Inputs | None = None,
    axes: np.ndarray | None = None,
    progress: Progress = no_progress,
    cut: CutMask | None = None,
    former: "Styling | None" = None,
) -> "Styling | None":
    """Return the `Styling` of strands; None if strands follow their guides unchanged (`is_plain`).

    axes: (4, 4) to the surface's own coordinates, from `own_axes`, None for the identity; progress(step, part):
    callback for the placement of clump sites, may raise to cancel; cut: the `CutMask` of strands whose lengths differ,
    None for the length of the settings; former: as of `stack.bind`.
    """
    if cut is None and is_plain(guides, settings, styles):
        return None
    inputs = Inputs() if inputs is None else inputs
    varied = styling.varied_numbers.varied_trees(styles, inputs.numbers, binding, inputs.guide_sets)
    own = {place: found.tree for place, found in varied.items()}
    trees.search([tree for tree, _level in styling.program.tree_levels(styles, own)], progress)
    if cut is not None or settings.strand_length != 1.0:
        mask = CutMask(settings.strand_length) if cut is None else cut
        styles = (styling.program.CUT, *styles)
        masks = {**inputs.masks, styling.program.CUT_KEY: mask}
        inputs = replace(inputs, masks=masks, numbers=_below(inputs.numbers), courses=_below(inputs.courses))
        varied = {place + 1: found for place, found in varied.items()}
    axes = np.eye(4) if axes is None else axes
    return styling.stack.bind(binding, guides, styles, inputs, trees, axes, settings.point_count, varied, former)


def _below(of_styles):
    """Return {(index of a style, name): value} with indices raised by one, as a style precedes these styles."""
    return {(place + 1, name): value for (place, name), value in of_styles.items()}


def is_plain(guides: Strands, settings: HairSettings, styles: Sequence[StyleSettings]) -> bool:
    """Return whether strands without maps follow their guides unchanged, with the guides' number of points."""
    has_styles = any(map(styling.base.has_effect, styles)) or settings.strand_length != 1.0
    return not has_styles and settings.point_count == guides.point_count


def own_axes(from_own: np.ndarray) -> np.ndarray:
    """Return the matrix (4, 4) from strand coordinates to a surface's own axes and origin, without scale and shear.

    from_own: (4, 4), from the surface's own to strand coordinates; its nearest rotation, or rotation and reflection, is
    inverted.
    """
    matrix = np.asarray(from_own, np.float64)
    left, _scale, right = np.linalg.svd(matrix[:3, :3])
    axes = np.eye(4)
    axes[:3, :3] = (left @ right).T
    axes[:3, 3] = -axes[:3, :3] @ matrix[:3, 3]
    return axes
