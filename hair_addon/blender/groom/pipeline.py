# SPDX-License-Identifier: GPL-3.0-or-later
"""The report's node graph in Blender: read geometry and settings, compute, write geometry.

mesh object ─ distribute_guides ─▶ Guides Curves ─ interpolate_hair ─▶ Hair Curves. Curves store their settings
and their inputs, so `evaluate` can regenerate them.
"""

from collections.abc import Callable, Sequence
from typing import TypedDict

import numpy as np
from bpy.types import Curves, Depsgraph, Object

from ...core.errors import HairError, memory_as_sentence
from ...core.geometry import strands
from ...core.geometry.faces.uv_maps import Texture
from ...core.geometry.mesh import TriMesh
from ...core.grooming import following, groom, style_binding
from ...core.grooming.groom import GuideSettings, HairSettings
from ...core.interpolation import hair_binding
from ...core.interpolation.regions import Regions
from ...core.long_work import Work, no_progress, part_of, run_now
from ...core.placement import densities
from ...core.styling.base import StyleSettings
from ..data import masks, scene, surface_space, whole_changes
from ..data.strands import curves, drawn_lines, partings
from ..data.surfaces import Surface
from ..host.datablocks import Remembered
from ..host.notices import name_of
from ..layers import carried_variation
from ..settings import preferences, setting_properties, style_items
from . import (
    bindings,
    grown_guides,
    hair_memory,
    read_surfaces,
    reused_roots,
    size_fitting,
    styled_hair,
    varied_guides,
    varied_strands,
    writing,
)
from .bindings import BoundHair
from .styled_hair import ReadStyles, StyledHair


def distribute_guides(
    surface_object: Object,
    settings: GuideSettings,
    depsgraph: Depsgraph,
    target: Curves | None = None,
    keeps_roots: bool = False,
) -> Curves:
    """Grow guides on a mesh object; returns their Curves, of a new object unless `target` is given.

    keeps_roots: keep the roots of `target` if the inputs of their placement have not changed. Raises `HairError` before
    anything in the scene changes.
    """
    return run_now(distributing_guides(surface_object, settings, depsgraph, target, keeps_roots))


@whole_changes.whole_if_new
def distributing_guides(
    surface_object: Object,
    settings: GuideSettings,
    depsgraph: Depsgraph,
    target: Curves | None = None,
    keeps_roots: bool = False,
    may_drape: bool = False,
) -> Work[Curves]:
    """`distribute_guides` as work in steps (core/long_work.py); may_drape: as in `adding_hair`."""
    surface = read_surfaces.read(surface_object, depsgraph)
    mask = masks.own(settings).read(surface_object, surface, depsgraph)
    sized = size_fitting.of_guides(settings, surface, mask, target if keeps_roots else None, may_drape)
    settings, key = sized.settings, sized.root_key
    hair_memory.require_guides(settings, len(surface.mesh.triangles))
    roots = reused_roots.of(target, surface, key, settings.guide_count) if keeps_roots else None
    part_names = drawn_lines.part_names_around(target)
    flow = drawn_lines.read_flow(surface_object, surface, settings.flow_lines, part_names, depsgraph)
    varied = varied_guides.read(target, surface_object, surface, settings)
    place, target, device = Remembered(surface_object), Remembered(target), preferences.device()
    shown = scene.shown_surface(surface_object, surface)
    variation = carried_variation.read(target.find(), surface, settings.seed)
    random = None if variation is None else variation.at

    def compute(progress):
        laid_flow = flow.at_rest(shown, surface, device)
        return grown_guides.grow(surface, settings, mask, laid_flow, progress, roots, varied, random)

    grown = yield compute
    guides = writing.write_guides(target.find(), place.find(), surface, grown, settings, key, flow.key, sized.fits)
    carried_variation.write(guides, variation, grown.strands.roots, settings.seed)
    return guides


def interpolate_hair(
    guide_curves: Curves, settings: HairSettings, depsgraph: Depsgraph, target: Curves | None = None
) -> Curves:
    """Grow strands between guides; returns their Curves, of a new object unless `target` is given.

    Raises `HairError` before anything in the scene changes.
    """
    return run_now(interpolating_hair(guide_curves, settings, depsgraph, target))


@whole_changes.whole_if_new
def interpolating_hair(
    guide_curves: Curves,
    settings: HairSettings,
    depsgraph: Depsgraph,
    target: Curves | None = None,
    styles: Sequence[StyleSettings] = (),
) -> Work[Curves]:
    """`interpolate_hair` as work in steps; styles: of new hair, to be stored by `writing.keep_styles`."""
    place, its_guides, its_target = map(Remembered, (guide_curves.surface, guide_curves, target))
    bound = yield from _binding_hair(guide_curves, settings, depsgraph, target, styles)
    writing.require_count(its_target.find(), len(bound.binding.positions), settings.point_count)
    if target is not None:
        varied_strands.apply(its_target.find(), bound)
    # Last, so that nothing happens between this and writing.
    bindings.grow_in_place_of(its_target.find(), bound)
    return writing.write_strands(its_target.find(), place.find(), its_guides.find(), bound)


def bind_hair(
    guide_curves: Curves, settings: HairSettings, depsgraph: Depsgraph, target: Curves | None = None
) -> BoundHair:
    """Return the `BoundHair` between guides without writing it. Strands of `target` keep their roots if possible."""
    bound = run_now(_binding_hair(guide_curves, settings, depsgraph, target))
    if target is not None:
        varied_strands.apply(target, bound)
    bound.grow()
    return bound


def _binding_hair(guide_curves, settings, depsgraph, target, new_styles=()):
    """Compute the `BoundHair` between guides, without its points, as work in steps."""
    surface = read_surfaces.read(guide_curves.surface, depsgraph, target)
    bound = None if target is None else bindings.of(target)
    its_guides = bound.guides if bound is not None and bound.surface is surface else None
    guides = curves.read_guides(guide_curves, surface, preferences.device(), its_guides)
    mask = masks.of_strands(settings, guide_curves.vellus.guides).read(guide_curves.surface, surface, depsgraph)
    sized = size_fitting.of_hair(settings, surface, mask, len(guides.roots), target)
    settings, key = sized.settings, sized.root_key
    hair_memory.require_strands(settings, target)
    parting = partings.read(guide_curves.surface, surface, guide_curves, settings, depsgraph)
    styles = new_styles if target is None else style_items.styles_of(target.vellus)
    read = styled_hair.read_styles(styles, guide_curves.surface, surface, guide_curves, depsgraph, target)
    known = _known_binding(target, settings, key, parting.key, guides, surface)
    roots = reused_roots.of(target, surface, key, settings.strand_count) if known is None else None
    device, guide_uid = preferences.device(), guide_curves.session_uid

    inputs = _placement_inputs(surface, scene.shown_surface(guide_curves.surface, surface), mask, parting, device)
    if target is not None:
        made_on = surface_space.made_on(target, surface.rest)
        inputs["shape"] = surface.former_shape(made_on, surface_space.applied(target))

    def compute(progress):
        if known is None:
            binding = _bind(surface, guides, settings, inputs, roots, progress)
            make_trees = _trees_on(surface, guides, settings, inputs)
        else:
            binding = hair_binding.reweighed(known.binding, settings)
            make_trees = styled_hair.reweighed_trees(known.styles, settings)
        placing = part_of(progress, 0.5, 0.8)
        styles = styled_hair.bind(read, binding, guides, settings, surface, make_trees, placing)
        bound = BoundHair(binding, settings, key, parting.key, guides, guide_uid, surface, styles, fits=sized.fits)
        return _known_by(bound, progress)

    return (yield compute)


def _known_binding(target, settings, key, parting_key, guides, surface):
    """Return the present `BoundHair` if a search would find the same guides; otherwise None.

    Changes of weights, limits and widths therefore need no search.
    """
    bound = None if target is None else bindings.of(target)
    if bound is None or (bound.root_key, bound.parting_key) != (key, parting_key):
        return None
    most = bound.binding.candidates.indices.shape[1] - 1
    is_same = bound.surface.has_same_rest(surface) and bound.guides.roots.is_same(guides.roots)
    return bound if is_same and settings.neighbour_limit <= most else None


def complete(
    surface_object: Object, guide_settings: GuideSettings, hair_settings: HairSettings, depsgraph: Depsgraph
) -> tuple[GuideSettings, HairSettings]:
    """Return `GuideSettings` and `HairSettings` with unset values fitted to a mesh object. Raises `HairError`."""
    read_surfaces.require_mesh(surface_object)
    surface = scene.read_surface(surface_object, depsgraph).sized_cage
    sized, _masks = _completed(surface_object, surface, guide_settings, hair_settings, depsgraph)
    return sized[0].settings, sized[1].settings


def _completed(surface_object, surface, guide_settings, hair_settings, depsgraph, may_drape=False):
    """Return ((`Sized` guides, `Sized` hair), their masks); a mask: (weights (V,), `Texture`)."""
    guide_mask, hair_mask = masks.own(guide_settings), masks.of_strands(hair_settings, guide_settings)
    of_guides = guide_mask.read(surface_object, surface, depsgraph)
    of_hair = of_guides if hair_mask == guide_mask else hair_mask.read(surface_object, surface, depsgraph)
    guides = size_fitting.of_guides(guide_settings, surface, of_guides, may_drape=may_drape)
    hair = size_fitting.of_hair(hair_settings, surface, of_hair, guides.settings.guide_count)
    return (guides, hair), (of_guides, of_hair)


@whole_changes.whole
def adding_hair(
    surface_object: Object,
    guide_settings: GuideSettings,
    hair_settings: HairSettings,
    depsgraph: Depsgraph,
    styles: Sequence[StyleSettings] = (),
    may_drape: bool = False,
) -> Work[tuple[Curves, Curves]]:
    """Grow guides on a mesh object and hair between them, as work in steps; returns the Curves of both.

    styles: as in `interpolating_hair`; may_drape: let `grown_guides.draped_if_new` choose draping. No object is created
    before everything is computed.
    """
    surface = read_surfaces.read(surface_object, depsgraph)
    sized, read = _completed(surface_object, surface, guide_settings, hair_settings, depsgraph, may_drape)
    (of_guides, of_hair), (mask, hair_mask) = sized, read
    guide_settings, hair_settings = of_guides.settings, of_hair.settings
    guide_bytes = hair_memory.guide_bytes(guide_settings, len(surface.mesh.triangles))
    hair_memory.require_strands(hair_settings, other_bytes=guide_bytes)
    parting = partings.read(surface_object, surface, None, hair_settings, depsgraph)
    part_names = drawn_lines.existing({hair_settings.part_lines})
    flow = drawn_lines.read_flow(surface_object, surface, guide_settings.flow_lines, part_names, depsgraph)
    styling = styled_hair.read_styles(styles, surface_object, surface, None, depsgraph)
    device, place = preferences.device(), Remembered(surface_object)
    shown = scene.shown_surface(surface_object, surface)

    def compute(progress):
        groom.load_kernels(device, progress)
        inputs = _placement_inputs(surface, shown, hair_mask, parting, device)
        laid_flow = flow.at_rest(shown, surface, device)
        grown = grown_guides.grow(surface, guide_settings, mask, laid_flow, part_of(progress, 0.0, 0.5))
        guides = _as_written(grown.strands, surface, device)
        progress = part_of(progress, 0.5, 1.0)
        binding = _bind(surface, guides, hair_settings, inputs, None, progress)
        styled = _styled(styling, binding, guides, hair_settings, surface, inputs, part_of(progress, 0.5, 0.8))
        known = binding, hair_settings, of_hair.root_key, parting.key, guides, None, surface, styled
        bound = BoundHair(*known, fits=of_hair.fits)
        return grown, _growing(bound, progress)

    grown, bound = yield compute
    keys = of_guides.root_key, flow.key, of_guides.fits
    guide_curves = writing.write_guides(None, place.find(), surface, grown, guide_settings, *keys)
    return guide_curves, write_between(guide_curves, bound)


def hair_between(
    surface_object: Object, surface: Surface, settings: HairSettings, depsgraph: Depsgraph
) -> Callable[..., BoundHair]:
    """Return a function of (guides, progress, density) that computes the `BoundHair` between unwritten `Strands`.

    surface: at its present level of subdivision; density: (V,) where strands grow, None for the vertex group of the
    settings.
    """
    hair_memory.require_strands(settings)
    shown, surface = surface, surface.sized_cage
    painted, texture = masks.own(settings).read(surface_object, surface, depsgraph)
    parting = partings.read(surface_object, surface, None, settings, depsgraph)
    device = preferences.device()

    def compute(guides, progress, density=None):
        density = painted if density is None else shown.of_cage(density)
        mask = density, texture
        sized = size_fitting.of_hair(settings, surface, mask, len(guides))
        completed, inputs = sized.settings, _placement_inputs(surface, shown, mask, parting, device)
        if surface is not shown:
            roots = curves.nearest_roots(surface, guides.numpy()[:, 0])
            guides = strands.from_numpy(guides.numpy(), roots, device)
        binding = _bind(surface, guides, completed, inputs, None, progress)
        styles = _styled(ReadStyles(), binding, guides, completed, surface, inputs)
        known = binding, completed, sized.root_key, parting.key, guides, None, surface, styles
        return _growing(BoundHair(*known, fits=sized.fits), progress)

    return compute


def write_between(guide_curves: Curves, bound: BoundHair) -> Curves:
    """Write hair computed by `hair_between` to new Curves, after its guides are written; returns the Curves."""
    bound.guide_uid = guide_curves.session_uid
    return writing.write_strands(None, guide_curves.surface, guide_curves, bound)


def _as_written(guides, surface, device):
    """Return guides rounded in local coordinates, as they would be read from Curves."""
    points = surface.to_local(guides.numpy())
    return strands.from_numpy(surface.from_local(points), guides.roots, device)


class _PlacementInputs(TypedDict):
    """The surface on which strands and clump sites are placed: arguments of `groom.bind_hair`, described there."""

    density: np.ndarray | None
    texture: Texture | None
    regions: Sequence[Regions]
    lines: np.ndarray | None
    drawn_on: np.ndarray | None
    shape: TriMesh | None
    is_mirrored: bool
    tie_fractions: np.ndarray | None
    device: str


def _placement_inputs(surface, shown, mask, parting, device) -> _PlacementInputs:
    """Return the `_PlacementInputs` of a surface.

    mask: (density, texture); shown: the subdivided surface with drawn lines.
    """
    density, texture = mask
    return _PlacementInputs(
        density=density,
        texture=texture,
        regions=parting.regions,
        lines=drawn_lines.at_rest(parting.lines, shown, surface, device),
        drawn_on=surface.drawn_on,
        shape=surface.shape,
        is_mirrored=surface.has_flipped_winding,
        tie_fractions=parting.tie_fractions,
        device=device,
    )


def _bind(surface, guides, settings, inputs, roots, progress):
    return groom.bind_hair(surface.mesh, guides, settings, roots=roots, progress=part_of(progress, 0.0, 0.5), **inputs)


def _trees_on(surface, guides, settings, inputs):
    """Return a function that builds the `ClumpTrees` of hair."""
    return lambda: style_binding.clump_trees(surface.mesh, guides.roots, settings, **inputs)


def _styled(read, binding, guides, settings, surface, inputs, progress=no_progress):
    """Return the `StyledHair` of new hair."""
    make_trees = _trees_on(surface, guides, settings, inputs)
    return styled_hair.bind(read, binding, guides, settings, surface, make_trees, progress)


def _growing(bound, progress):
    """Complete a `BoundHair` and start computing its points on other threads; returns it."""
    _known_by(bound, progress)
    bound.grow()
    return bound


def _known_by(bound, progress):
    """Complete a `BoundHair` except for its points; returns it."""
    progress("Growing strands", 0.8)
    _ = bound.binding.leaders, bound.binding.identities  # before other threads need the CPU
    return bound


@memory_as_sentence()
def restyle(
    target: Curves, depsgraph: Depsgraph, is_drawn: Callable[[BoundHair, StyledHair], bool] = lambda *_given: False
) -> bool:
    """Apply the present styles and map of the thickness to bound hair; returns whether nothing else had changed.

    is_drawn: whether the GPU generates the shown strands. Nothing is searched, and nothing is computed if styles are
    unchanged: on a surface that was scaled after binding, hair without a density keeps the scale of its binding until a
    style changes.
    Raises `HairError`.
    """
    bound = bindings.of(target)
    guide_curves, settings = inputs_of(target)
    if bound is None or bound.settings != settings or bound.guide_uid != guide_curves.session_uid:
        return False
    has_scale = bindings.has_scale(bound, guide_curves.surface)
    if not has_scale and (densities.is_set(settings) or surface_space.is_flattened(guide_curves.surface)):
        return False
    if not bindings.can_read_masks(bound, target, depsgraph):  # rebinding the hair reports the error
        return False
    device = bound.binding.positions.device
    guides = curves.read_shown_guides(guide_curves, bound.surface, device, bound.guides)
    combed = following.combed(guides, bound.guides)
    if combed is None or len(combed):
        return False
    styles = style_items.styles_of(target.vellus)
    read = styled_hair.read_styles(styles, guide_curves.surface, bound.surface, guide_curves, depsgraph, target)
    if not read.is_same(bound.styles.read):
        if not has_scale:
            return False
        before = bound.styles
        trees = before.shared_trees()
        styles = styled_hair.bind(read, bound.binding, guides, settings, bound.surface, trees, former=before)
        bound.restyle(styles, is_drawn(bound, styles))
    varied_strands.apply(target, bound)
    return True


def evaluate(target: Curves, depsgraph: Depsgraph) -> None:
    """Regenerate Curves from their stored settings and inputs. Errors become their status.

    Combed Curves do not change: only an operator replaces them. Curves stay stale while the surface's scale is zero.
    """
    state = target.vellus
    state.is_stale = False
    try:
        require_uncombed(target)
        if state.kind == "GUIDES":
            settings = setting_properties.to_settings(state.guides, groom.GuideSettings)
            distribute_guides(target.surface, settings, depsgraph, target, keeps_roots=True)
        elif state.kind == "HAIR" and not _is_restyled(target, depsgraph):
            interpolate_hair(*inputs_of(target), depsgraph, target)
    except HairError as error:
        state.status = str(error)
        state.is_stale = target.surface is not None and surface_space.is_flattened(target.surface)


def _is_restyled(target, depsgraph):
    if not restyle(target, depsgraph):
        return False
    writing.write_hair(target)
    bound = bindings.of(target)
    target.vellus.status = "" if bound is None else bound.map_status
    return True


def require_uncombed(target: Curves) -> None:
    """Raise `HairError` for hand-edited Curves."""
    if not curves.is_combed(target):
        return
    if target.vellus.kind == "HAIR":
        if curves.is_hand_made(target):
            raise HairError("Kept unchanged: these settings do not apply. Regenerate Strands replaces the strands.")
        raise HairError("Hand-edited: these settings no longer apply. Regenerate Strands discards the edits.")
    if curves.is_hand_made(target):
        raise HairError("Hand-made: these settings do not apply. Regenerate Guides replaces the guides.")
    raise HairError(
        "Hand-edited: these settings no longer apply. Use Guide Tools; Regenerate Guides discards the edits."
    )


def inputs_of(target: Curves) -> tuple[Curves, HairSettings]:
    """Return (guide Curves, `HairSettings`) of a hair Curves datablock. Raises `HairError`."""
    state = target.vellus
    if state.guide_curves is None:
        raise HairError('"{name}" has no guides: pick them in the Strands panel.', name=name_of(target))
    return state.guide_curves, setting_properties.to_settings(state.hair, groom.HairSettings)
