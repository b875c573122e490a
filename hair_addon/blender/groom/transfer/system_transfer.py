# SPDX-License-Identifier: GPL-3.0-or-later
"""Transfer of a hair system: a copy of its guides and hair on another mesh, with all settings, styles and the look.

Guides are mapped by core/grooming/groom_transfer.py. The copies keep their attributes, and like hand-made guides they
are not regenerated. The hair between them is generated again.
"""

from dataclasses import dataclass, replace
from typing import Any

import bpy
import numpy as np
from bpy.types import Curves, Depsgraph, Object

from ....core import geometry, grooming
from ....core.errors import HairError
from ....core.geometry.landmark_warp import Warp
from ....core.geometry.mesh import check_mesh, positions
from ....core.grooming.groom import HairSettings
from ....core.grooming.groom_transfer import Places, TransferSurface
from ....core.grooming.transfer_settings import TransferSettings
from ....core.long_work import Work
from ...data import landmarks, scene, surface_space, usable_surfaces, whole_changes
from ...data.strands import (
    attributes,
    curves,
    curves_objects,
    gathered_groups,
    guide_curves,
    kept_shapes,
    layer_attributes,
)
from ...data.surfaces import Surface
from ...host.datablocks import Remembered
from ...host.notices import name_of
from ...layers import recording
from ...materials import looks
from ...settings import setting_properties
from .. import pipeline
from ..foreign import hand_made_guides
from ..guides import guide_tools
from ..guides.guide_tools import CombedGuides
from . import carried_masks, transferred_names

_OVERLAPPING = 0.01  # fraction of a surface's area: more ambiguous UVs are reported


@dataclass(frozen=True)
class TransferredGroom:
    """New guide Curves and hair Curves (None for guides without hair), and results to report.

    guide_count: of the source; places: `Places` of its guides; painted: vertex groups created from the source; cleared:
    names in settings that the mesh lacks.
    """

    guides: Curves
    hair: Curves | None
    guide_count: int
    places: Places
    painted: tuple[str, ...]
    cleared: tuple[str, ...]
    has_overlap: bool

    def notes(self) -> list[tuple[str, dict[str, Any]]]:
        """Return [(sentence, values)] to report to the user."""
        places, surface = self.places, name_of(self.guides.surface)
        messages: list[tuple[str, dict[str, Any]]] = []
        if places.lost_count:
            sentence = (
                "{count} of {all} guides could not be placed: {far} too far from the surface, {other} facing away."
            )
            values = {"all": self.guide_count, "far": places.far_count, "other": places.other_side_count}
            messages.append((sentence, {"count": places.lost_count, **values}))
        if self.painted:
            messages.append(
                ('"{name}" has new vertex groups: {names}.', {"name": surface, "names": ", ".join(self.painted)})
            )
        if self.cleared:
            sentence = 'These do not exist on "{name}" and were cleared from the settings: {names}.'
            messages.append((sentence, {"name": surface, "names": ", ".join(self.cleared)}))
        if self.has_overlap:
            messages.append(('The UVs of "{name}" overlap: guides may be on another part of it.', {"name": surface}))
        return messages


@whole_changes.whole
def transferring(
    guides: Curves, hair: Curves | None, target: Object, settings: TransferSettings, depsgraph: Depsgraph
) -> Work[TransferredGroom]:
    """Copy guides, and hair that follows them (or None), to another mesh object, as work in steps.

    Raises `HairError` before anything changes.
    """
    if target.type != "MESH" or target == guides.surface:
        raise HairError("Pick another mesh to transfer the groom to.")
    curves.require_overridable(target)
    usable_surfaces.require_evaluated(target)
    usable_surfaces.require_object_mode(target)
    if hair is not None:
        pipeline.inputs_of(hair)
    curves.require_overridable(guides)
    recording.update(guides, depsgraph)
    source = guide_tools.open_guides(guides, depsgraph)
    curves_objects.store_rest_positions(target)
    surface = scene.read_surface(target, scene.present_depsgraph())
    check_mesh(surface.mesh)
    warp = _warp(guides.surface, source.surface, target, surface, settings, depsgraph)
    its_surface, target_surface = (TransferSurface(one.mesh, one.corner_uvs) for one in (source.surface, surface))
    masks = carried_masks.read(guides, hair, target, depsgraph)
    remembered = tuple(map(Remembered, (guides, hair, target)))

    def compute(progress):
        progress("Finding places", 0.0)
        places = _places(its_surface, target_surface, source.roots, warp, settings)
        meshes = source.surface.mesh, surface.mesh
        points = grooming.groom_transfer.carried(*meshes, source.roots, source.points, source.counts, places)
        painted = carried_masks.carried(masks, its_surface, target_surface, warp, settings.reach)
        return places, points, painted, warp is None and _has_overlap(surface)

    places, points, painted, has_overlap = yield compute
    guides, hair, target = (one.find() for one in remembered)
    names = carried_masks.paint(target, surface, painted)
    new_guides = _copy(guides, target, is_rendered=False)
    _write_guides(new_guides, source, surface, places, points)
    cleared = transferred_names.clear(new_guides, hair=None, target=target)
    new_hair = None
    if hair is not None:
        new_hair = _copy(hair, target, is_rendered=True)
        new_hair.vellus.guide_curves = new_guides
        cleared += transferred_names.clear(new_guides, new_hair, target)
    new_guides.vellus.is_stale = False  # settings are changed together with their data
    if new_hair is not None:
        yield from _growing(new_guides, new_hair, surface, places)
    looks.evaluate_guides(new_guides)
    cleared = tuple(dict.fromkeys(cleared))
    return TransferredGroom(new_guides, new_hair, len(source.roots), places, tuple(names), cleared, has_overlap)


def _warp(its_object, its_surface: Surface, target, surface: Surface, settings, depsgraph):
    """Return the `Warp` before the nearest surface is searched; None for the UV method. Raises `HairError`."""
    if settings.method == "UV":
        return None
    if settings.method == "LANDMARKS":
        return _through_landmarks(
            landmarks.read(its_object, its_surface, depsgraph),
            landmarks.read(target, surface, scene.present_depsgraph()),
        )
    if settings.alignment == "BOXES":
        return geometry.landmark_warp.between_boxes(its_surface.mesh.vertices, surface.mesh.vertices)
    if settings.alignment == "LOCAL":
        return Warp(surface.to_world_axes @ its_surface.to_local_axes, np.zeros(3))
    apart = np.array(its_object.matrix_world.translation) - np.array(target.matrix_world.translation)
    return Warp(np.eye(3), apart)


def _places(source: TransferSurface, target: TransferSurface, roots, warp, settings):
    """Return the `Places` of guides. Raises `HairError`."""
    transfer, scales = grooming.groom_transfer, settings.scale_lengths
    if warp is None:
        return transfer.places_by_uv(source, target, roots, scales)
    return transfer.places_by_warp(source.mesh, target.mesh, roots, warp, settings.reach, scales)


def _has_overlap(surface):
    return geometry.faces.uv_maps.misleading_fraction(surface.mesh, surface.corner_uvs) > _OVERLAPPING


def _through_landmarks(own, others):
    names = sorted(own.keys() & others.keys())
    if not names:
        raise HairError(
            'The meshes have no landmarks: give both vertex groups or empty children of the same names, "Landmark …".'
        )
    return geometry.landmark_warp.through_landmarks([own[name] for name in names], [others[name] for name in names])


def _copy(datablock, target, is_rendered):
    """Copy Curves to a new object on a mesh; returns the copy."""
    copy = datablock.copy().make_local(clear_liboverride=True)
    copy.surface = target
    kept_shapes.forget(copy)
    surface_space.forget_applied(copy)
    state = copy.vellus
    state.root_key = state.parting_key = state.flow_key = state.followed = ""
    state.cache_identity = state.delivered_key = state.status = ""
    curves_objects.link_object(name_of(datablock), copy, target, is_rendered)
    state.is_stale = False
    return copy


def _write_guides(guides, source: CombedGuides, surface: Surface, places: Places, points):
    """Write the places, layers and points of copied guides."""
    scale = source.surface.scale * places.scale  # [m] per unit of former coordinates
    lost = np.setdiff1d(np.arange(len(guides.curves)), places.kept)
    guide_curves.remove(guides, lost)
    gathered = gathered_groups.read(guides)  # fractions of the former lengths
    starts = curves.curve_offsets(guides)
    _move_layers(guides, source, surface, places)
    apart = np.linalg.norm(points[starts[:-1]] - positions(surface.mesh, places.roots), axis=1)
    attributes.write_positions(guides, surface.to_local(points[:, None])[:, 0])
    attributes.write(guides, "radius", "FLOAT", "POINT", curves.read_radii(guides) * (scale / surface.scale))
    for name, data_type, values in zip(
        ("id", "strand_random"), ("INT", "FLOAT"), surface.identities(places.roots), strict=True
    ):
        attributes.write(guides, name, data_type, "CURVE", values)
    guides.vellus.written = curves.BY_HAND
    if len(guides.vellus.layers):
        guides.vellus.is_base_grown = False
        recording.note_shape(guides)
    if gathered is not None:
        gathered_groups.write(guides, gathered)
    curves.write_roots(guides, surface, places.roots)
    attributes.write(guides, "root_distance", "FLOAT", "CURVE", apart / surface.scale)
    surface_space.keep_surface(guides, surface)
    transferred_names.scale_lengths(guides.vellus.guides, places.scale)
    transferred_names.scale_lengths(guides.vellus.dynamics, places.scale)


def _move_layers(guides, source, surface, places):
    """Transfer the base and the layers of copied guides; lost guides are removed."""
    roots, counts = source.roots[places.kept], curves.point_counts(guides)
    places = replace(places, kept=np.arange(len(roots)))

    def move(points):
        meshes = source.surface.mesh, surface.mesh
        there = grooming.groom_transfer.carried(*meshes, roots, source.surface.from_local(points), counts, places)
        return surface.to_local(there[:, None])[:, 0]

    layer_attributes.move(guides, move)


def _growing(guides, hair, surface, places):
    """Grow copied hair between copied guides, as work in steps."""
    state = hair.vellus
    transferred_names.scale_lengths(state.hair, places.scale)
    for item in state.styles:
        transferred_names.scale_style(item, places.scale)
    if not (state.hair.density_group or state.hair.density_image or guides.vellus.guides.density_group):
        name = hand_made_guides.paint_area(guides.surface, surface, places.roots)
        if name:
            state.hair.density_group = name
    was_live, state.is_live = state.is_live, False  # else the update would generate it first
    bpy.context.view_layer.update()
    state.is_live, state.is_stale = was_live, False
    settings = setting_properties.to_settings(state.hair, HairSettings)
    yield from pipeline.interpolating_hair(guides, settings, scene.present_depsgraph(), hair)
