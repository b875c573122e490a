# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes of hair cards, tubes and solid locks → hair and guides."""

from dataclasses import dataclass, replace
from typing import Any

import bpy
import numpy as np
from bpy.types import Curves, Depsgraph, Object

from ...core import maps
from ...core.errors import HairError
from ...core.files.curve_file import CurveSet
from ...core.geometry.mesh import TriMesh
from ...core.grooming.derived_guides import DerivationSettings
from ...core.long_work import Work, part_of
from ...core.maps.map_settings import MapSettings
from ...core.mesh_hair import mesh_strands, piece_strands, surface_roots, texture_alpha
from ...core.mesh_hair.mesh_strand_settings import MeshStrandSettings
from ...core.params import Param, plain_value
from ..data import scene, usable_surfaces, whole_changes
from ..data.made import made_meshes
from ..data.pictures import hair_pieces
from ..data.strands import attributes
from ..groom.foreign import kept_hair
from ..groom.foreign.kept_hair import KeptHair
from ..host.datablocks import Remembered
from ..host.notices import name_of
from ..materials import looks
from ..settings import map_items, properties
from . import curve_objects, strand_arrays

COLOR = "mesh_color"  # attribute of strands


@dataclass(frozen=True)
class MeshHair:
    """The `KeptHair` of a mesh, the number of its cards, tubes and locks, and the number of skipped pieces."""

    kept: KeptHair
    piece_count: int
    skipped_count: int

    @property
    def hair(self) -> Curves:
        """The hair Curves."""
        return self.kept.hair

    @property
    def guides(self) -> Curves:
        """The guide Curves."""
        return self.kept.guides

    def notes(self) -> list[tuple[str, dict[str, Any]]]:
        """Return [(sentence, values)] to report to the user."""
        sentence = "{count} parts of the mesh were left out: they are no cards, tubes or slender locks, or too large."
        own = [(sentence, {"count": self.skipped_count})] if self.skipped_count else []
        return own + self.kept.notes()


@whole_changes.whole
def using_mesh(
    mesh_object: Object,
    surface_object: Object,
    depsgraph: Depsgraph,
    settings: MeshStrandSettings,
    derivation: DerivationSettings,
    *,
    hides_mesh: bool = True,
) -> Work[MeshHair]:
    """Turn a mesh object of hair into hair on a surface and derive guides, as work in steps; returns `MeshHair`.

    hides_mesh: hide the mesh object in viewports and renders. Raises `HairError` before anything changes.
    """
    hides_mesh = plain_value("Hide Mesh", hides_mesh, True, Param(""))
    _require_usable(mesh_object, surface_object)
    pieces = hair_pieces.read(mesh_object, depsgraph)
    mesh = TriMesh(_in_world(mesh_object, pieces.vertices), pieces.triangles)
    surface = curve_objects.world_mesh(surface_object)
    name = name_of(mesh_object)
    place, its_surface = Remembered(mesh_object), Remembered(surface_object)

    found, colors = yield lambda progress: _strands_of(mesh, surface, pieces, settings, progress)
    made = _new_curves(f"{name} Hair", found, settings, its_surface.find())
    if colors is not None:
        rows = np.concatenate([colors, np.ones((len(colors), 1))], axis=1)
        attributes.write(made.data, COLOR, "FLOAT_COLOR", "CURVE", rows)
    kept = yield from kept_hair.using_as_hair(
        made, its_surface.find(), scene.present_depsgraph(), derivation, is_directed=True
    )
    if colors is not None:
        _show_colors(kept.hair, colors)
    if hides_mesh:
        made_meshes.hide(place.find())
    return MeshHair(kept, found.piece_count, found.skipped_count)


def _strands_of(mesh, surface, pieces, settings, progress):
    """Return the `MeshStrands` of a mesh in the world, and their linear colors (S, 3), None without colors."""
    alpha_at = pieces.alphas if settings.uses_alpha and pieces.has_alpha else None
    reading = part_of(progress, 0.0, 0.5)
    found = piece_strands.mesh_strands(mesh, surface, settings, pieces.corner_uvs, reading, alpha_at)
    if alpha_at is not None:
        found = texture_alpha.shown(found, alpha_at(found.places), alpha_at, mesh)
    colored = pieces.colors(found.places)
    means = mesh_strands.root_to_tip_means(found, colored) if pieces.has_colors else None
    if settings.reaches_surface:
        found = surface_roots.on_surface(found, surface)
    return found, None if means is None else maps.pixels.unpremultiplied(means)[0]


def _new_curves(name, found, settings, surface_object):
    """Return a new object with the curves of `MeshStrands`."""
    are_smooth, radii = np.zeros(len(found.counts), bool), found.radii if settings.fills else None
    return curve_objects.new_object(name, CurveSet(name, found.points, found.counts, are_smooth, radii), surface_object)


def _show_colors(hair, colors):
    """Give hair the mean of its strands' colors (S, 3), and a map of these colors."""
    color = tuple(np.clip(colors.mean(axis=0), 0.0, 1.0).tolist())
    own = properties.own_look_of(hair.vellus)
    looks.apply_look(hair, replace(own, parametrization="COLOR", color=color))
    map_items.keep(hair.vellus, MapSettings(setting="look.color", kind="CURVES", source=COLOR))


def _require_usable(mesh_object, surface_object):
    if mesh_object == surface_object:
        sentence = '"{name}" is the mesh of hair itself: pick the mesh that the hair grows on.'
        raise HairError(sentence, name=name_of(mesh_object))
    scene.require_scale(mesh_object)
    for one in (mesh_object, surface_object):
        usable_surfaces.require_evaluated(one)


def _in_world(mesh_object, vertices):
    """Return local vertices (V, 3) in the world [m], float32."""
    matrix = np.array(mesh_object.matrix_world, np.float64) * strand_arrays.meters_per_unit(bpy.context.scene)
    return (vertices.astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]).astype(np.float32)
