# SPDX-License-Identifier: GPL-3.0-or-later
"""Grooms for an asset library: extraction from hair, and application to a mesh object.

A groom is in meters and in the axes of its surface's object without that object's rotation, so that a rotated or scaled
object reproduces it exactly.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import bpy
import numpy as np
from bpy.types import Curves, Depsgraph, Object

from ....core import grooming
from ....core.errors import HairError
from ....core.files import library_settings
from ....core.files.settings_file import GroomSettings
from ....core.geometry.mesh import SurfacePoints, TriMesh, check_mesh
from ....core.long_work import Work
from ...data import scene, surface_collections, usable_surfaces, whole_changes
from ...data.strands import attributes, curves, gathered_groups, selection_sets
from ...host.notices import name_of
from ...settings import selection_names, setting_properties
from .. import pipeline
from ..foreign.hand_made_guides import HandMade
from . import carried_masks, groom_settings

if TYPE_CHECKING:
    from ....core.grooming.groom_transfer import TransferSurface

_GUIDE_RADIUS = 1.0 / 300.0  # of guides in viewports, by their length
_UNEQUAL = 1e-4  # masks whose weights differ by less are equal
_MANY = 0.2  # fraction of guides far from their places: the surfaces have other shapes


@dataclass(frozen=True)
class LibraryGroom:
    """A saved groom: guides on their surface, masks and settings.

    source: the surface; roots: G `SurfacePoints`; points: (N, 3) float32 [m] of the guides, concatenated; counts: (G,)
    of each; masks: {name: (V,) weights}; regions: {name: (G,) int32 or float32}, attributes of the guides, and
    saved selections of whole guides; left: names of objects and images in settings that are not part of the groom.
    """

    name: str
    source: "TransferSurface"
    roots: SurfacePoints
    points: np.ndarray
    counts: np.ndarray
    settings: GroomSettings
    masks: dict[str, np.ndarray] = field(default_factory=dict)
    regions: dict[str, np.ndarray] = field(default_factory=dict)
    left: tuple[str, ...] = ()


@dataclass(frozen=True)
class Applied:
    """Guide and hair Curves of a groom applied to a mesh object, and results to report.

    lost_count, aside_count: guides without a place, and guides far from where the alignment puts them.
    """

    made: HandMade
    method: str
    lost_count: int
    aside_count: int
    guide_count: int
    left: tuple[str, ...]

    def notes(self) -> list[tuple[str, dict[str, Any]]]:
        """Return [(sentence, values)] to report to the user."""
        many_aside = self.aside_count if self.aside_count > _MANY * self.guide_count else 0
        messages = [
            (self.lost_count, "{count} of {all} guides could not be placed on this surface and were left out.", {}),
            (many_aside, "{count} of {all} guides are far from their places, as this mesh has another shape.", {}),
            (len(self.left), "Not part of the groom: {names}.", {"names": ", ".join(self.left)}),
        ]
        values = {"all": self.guide_count}
        return [(sentence, {"count": count, **values, **more}) for count, sentence, more in messages if count]


def take(hair: Curves, name: str, depsgraph: Depsgraph) -> LibraryGroom:
    """Return the groom of a hair Curves datablock, as combed, at rest. Raises `HairError`."""
    guides, _settings = pipeline.inputs_of(hair)
    surface_object = guides.surface
    if surface_object is None or surface_object.type != "MESH":
        raise HairError('"{name}" has no surface: attach it to a mesh.', name=name_of(guides))
    surface = scene.read_surface(surface_object, depsgraph)
    settings, left = library_settings.alone(groom_settings.settings_of(hair))
    read = curves.read_guides(guides, surface, "cpu")
    local, starts = curves.read_points(guides), curves.curve_offsets(guides)
    points, counts = surface.from_local(local), np.diff(starts)
    if attributes.are_smooth(guides).any():
        points, counts = read.numpy().reshape(-1, 3), np.full(len(counts), read.point_count)
    rotation = _rotation(surface)
    source = grooming.groom_transfer.TransferSurface(_turned_mesh(surface.mesh, rotation.T), surface.corner_uvs)
    masks, regions = {}, {}
    for mask in library_settings.masks_of(settings):
        if mask in surface_object.vertex_groups:
            masks[mask] = scene.read_vertex_group(surface_object, depsgraph, mask)
    for region in (settings.hair.region_attribute, *library_settings.masks_of(settings)):
        values = _of_guides(guides, region)
        if values is not None:
            regions[region] = values
    gathered = gathered_groups.read(guides)
    if gathered is not None:
        names = gathered_groups.NAME, gathered_groups.HELD, gathered_groups.TIE
        regions.update(zip(names, (gathered.groups, gathered.held, gathered.tie_fractions), strict=True))
    for selection in selection_names.names_of(guides):
        are_chosen = selection_sets.read_guides(guides, selection)
        if are_chosen is not None:
            regions[selection_names.PREFIX + selection] = are_chosen.astype(np.int32)
    lost = {mask: "" for mask in library_settings.masks_of(settings) if mask not in masks and mask not in regions}
    settings = library_settings.renamed(settings, lost)
    if settings.hair.region_attribute and settings.hair.region_attribute not in regions:
        lost[settings.hair.region_attribute] = ""
        settings = replace(settings, hair=replace(settings.hair, region_attribute=""))
    turned = _turned(points, rotation.T)
    return LibraryGroom(
        name, source, read.roots, turned, counts, settings, masks, regions, tuple(dict.fromkeys([*left, *lost]))
    )


def _with_mask_of_guides(settings):
    """Return `HairSettings` with an explicit mask: strands without a mask use that of their guides."""
    hair = settings.hair
    return hair if hair.density_group else replace(hair, density_group=settings.guides.density_group)


def _of_guides(guides, name):
    for data_type in ("INT", "FLOAT"):
        if name and attributes.has(guides, name, data_type, "CURVE"):
            return attributes.read(guides, name, data_type, "CURVE")
    return None


def _rotation(surface):
    """Return the (3, 3) rotation of an object's local-to-world transform, without scale, shear and mirroring."""
    left, _scales, right = np.linalg.svd(surface.to_world_axes)
    sign = np.sign(np.linalg.det(left) * np.linalg.det(right))
    rotation = (left * [1.0, 1.0, sign]) @ right
    return np.eye(3) if np.allclose(rotation, np.eye(3), rtol=0.0, atol=1e-7) else rotation


def _turned(points, rotation):
    if np.array_equal(rotation, np.eye(3)):
        return np.asarray(points, np.float32)
    return (np.asarray(points, np.float64) @ rotation.T).astype(np.float32)


def _turned_mesh(mesh, rotation):
    return TriMesh(_turned(mesh.vertices, rotation), mesh.triangles)


@whole_changes.whole
def adding_groom(
    surface_object: Object,
    groom: LibraryGroom,
    depsgraph: Depsgraph,
    method: str = "AUTO",
    changed: Callable[[GroomSettings], GroomSettings] | None = None,
) -> Work[Applied]:
    """Apply a groom to a mesh object as new guides and hair, as work in steps; returns `Applied`.

    method: one of `groom_passage.METHODS`; changed: a function from the fitted settings to the ones to use. Raises
    `HairError` and then leaves nothing in the scene.
    """
    curves.require_overridable(surface_object)
    usable_surfaces.require_evaluated(surface_object)
    usable_surfaces.require_object_mode(surface_object)
    surface = scene.read_surface(surface_object, depsgraph)
    check_mesh(surface.posed_mesh)
    rotation = _rotation(surface)
    target = grooming.groom_transfer.TransferSurface(_turned_mesh(surface.posed_mesh, rotation.T), surface.corner_uvs)
    found = grooming.groom_passage.passage(groom.source, target, groom.roots, method)
    places = found.places
    points = grooming.groom_transfer.carried(
        groom.source.mesh, target.mesh, groom.roots, groom.points, groom.counts, places
    )
    settings = library_settings.scaled(groom.settings, places.scale)
    settings = settings if changed is None else changed(settings)
    settings = replace(settings, hair=_with_mask_of_guides(settings))
    painted = _painted(surface_object, surface, groom, target, found, depsgraph)
    settings = library_settings.renamed(settings, painted)
    drawn = _drawn(groom, surface_object, places.kept, surface.to_local(_turned(points, rotation)[None])[0])
    bpy.context.view_layer.update()
    # Attributes of guides exist only after the guides are written.
    unparted = replace(settings, hair=replace(settings.hair, region_attribute=""))
    made = yield from groom_settings.using_as_guides(drawn, surface_object, unparted, scene.present_depsgraph())
    _keep_settings(made, settings)
    aside_count = grooming.groom_passage.aside_count(groom.source, target, groom.roots, found)
    return Applied(made, found.method, places.lost_count, aside_count, len(groom.counts), groom.left)


def _painted(surface_object, surface, groom, target, found, depsgraph):
    """Return {mask: name of the surface's vertex group}; equal groups are reused, others are created."""
    if not groom.masks:
        return {}
    weights = np.stack(list(groom.masks.values()), axis=1)
    carried = grooming.groom_passage.carried_weights(groom.source, target, weights, found.warp)
    at_own = carried_masks.at_own_vertices(surface_object, surface, carried)
    painted = {}
    for mask, values, own_values in zip(groom.masks, carried.T, at_own.T, strict=True):
        is_there = mask in surface_object.vertex_groups and (
            np.abs(scene.read_vertex_group(surface_object, depsgraph, mask) - values).max(initial=0.0) <= _UNEQUAL
        )
        painted[mask] = mask if is_there else carried_masks.new_group(surface_object, mask, own_values)
    return painted


def _drawn(groom, surface_object, kept, points):
    """Create a Curves object of guides at points (N, 3), local to the surface, with the groom's regions."""
    datablock = bpy.data.hair_curves.new("Guides")
    datablock.add_curves([int(count) for count in groom.counts[kept]])
    datablock.set_types(type="POLY")
    attributes.write(datablock, "position", "FLOAT_VECTOR", "POINT", points)
    starts = curves.curve_offsets(datablock)
    lengths = np.linalg.norm(points[starts[1:] - 1] - points[starts[:-1]], axis=1)
    radii = np.full(len(points), _GUIDE_RADIUS * np.median(lengths), np.float32)
    attributes.write(datablock, "radius", "FLOAT", "POINT", radii)
    for name, values in groom.regions.items():
        attributes.write(datablock, name, "FLOAT" if values.dtype.kind == "f" else "INT", "CURVE", values[kept])
    drawn = bpy.data.objects.new("Guides", datablock)
    drawn.parent = surface_object
    surface_collections.collection_of(surface_object).objects.link(drawn)
    return drawn


def _keep_gathered(guides):
    """Store the lengths of guides up to their ties, which a groom has as fractions; returns whether there are any."""
    gathered = gathered_groups.read(guides)
    if gathered is not None:
        gathered_groups.write(guides, gathered)
    return gathered is not None


def _keep_selections(guides):
    """Save the selections of a groom, which has a number for each guide; returns whether there are any."""
    names = [name for name in guides.attributes.keys() if name.startswith(selection_names.PREFIX)]
    for name in names:
        values = attributes.read(guides, name, "INT", "CURVE")
        if values is not None:
            are_chosen = np.repeat(values != 0, curves.point_counts(guides))
            selection_sets.write(guides, name.removeprefix(selection_names.PREFIX), are_chosen)
    return bool(names)


def _keep_settings(made, settings):
    """Store the settings of the groom's guides and hair unchanged."""
    setting_properties.assign(made.guides.vellus.guides, settings.guides)
    if settings.hair.density_group == settings.guides.density_group:
        made.hair.vellus.hair.density_group = ""  # strands use the mask of the guides, which exist now
    are_kept = [_keep_selections(made.guides), _keep_gathered(made.guides)]
    made.hair.vellus.hair.region_attribute = settings.hair.region_attribute
    if settings.hair.region_attribute or any(are_kept):
        pipeline.evaluate(made.hair, scene.present_depsgraph())
    for target in (made.guides, made.hair):
        target.vellus.is_stale = False
    made.guides.vellus.status = ""
