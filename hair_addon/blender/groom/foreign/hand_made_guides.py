# SPDX-License-Identifier: GPL-3.0-or-later
"""Use of existing curves as guides, in place: no point moves in world space, and they are never regenerated.

Roots are found on the deformed surface; curves are then transformed back to the rest surface, where all guides are
stored.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import bpy
import numpy as np
from bpy.types import Depsgraph, Object, ViewLayer

from ....core import grooming, placement
from ....core.errors import HairError
from ....core.geometry import strands
from ....core.geometry.affine import Affine
from ....core.geometry.mesh import SurfacePoints, TriMesh, positions
from ....core.grooming.groom import HairSettings
from ....core.grooming.rooted_curves import RootedCurves, reversal
from ....core.long_work import Work, part_of
from ....core.params import Param, plain_value
from ...data import masks, scene, surface_space, usable_surfaces, vertex_groups, whole_changes
from ...data.strands import attributes, curves, curves_objects, follow_nodes, posed_strands
from ...data.surfaces import Surface
from ...host.datablocks import Remembered
from ...host.notices import name_of
from ...settings import preferences
from .. import pipeline, staleness
from . import foreign_curves
from .foreign_curves import SeenCurves

_SWITCH = Param("")
_GROUP = "Hair"  # vertex group of the area with guides


@dataclass(frozen=True)
class HandMade:
    """Guide Curves, hair Curves that follow them or None, and statistics of the curves."""

    guides: bpy.types.Curves
    hair: bpy.types.Curves | None
    rooted: RootedCurves

    def notes(self) -> list[tuple[str, dict[str, Any]]]:
        """Return [(sentence, values)] to report to the user."""
        far = float(self.rooted.distances.max()) * 1000.0
        messages = (
            (
                self.rooted.skipped_count,
                "{count} curves with zero length or non-finite points were removed.",
                {},
            ),
            (self.rooted.reversed_count, "{count} curves ran from tip to root and were reversed.", {}),
            (self.rooted.far_count, "{count} curves start off the surface, by up to {far:.3g} mm.", {"far": far}),
        )
        return [(sentence, {"count": count, **values}) for count, sentence, values in messages if count]


@dataclass(frozen=True)
class PlacedCurves:
    """Curves to be written: (N, 3) float32 local points at rest, (C,) point counts, (C,) bool.

    to_surface: from the curves' own coordinates to those of the surface, for their widths.
    """

    points: np.ndarray
    counts: np.ndarray
    is_smooth: np.ndarray
    rooted: RootedCurves
    to_surface: Affine

    @property
    def starts(self) -> np.ndarray:
        """(C+1,) offsets of each curve's points."""
        return strands.curve_offsets(self.counts)

    def even(self, surface: Surface) -> np.ndarray:
        """Return (C, POINT_COUNT, 3) float32 [m]: the curves as Blender draws them, resampled evenly."""
        return curves.even_points(surface.from_local(self.points), self.starts, lambda: self.is_smooth)


def find_surface(
    curves_object: Object, view_layer: ViewLayer, selected: Iterable[Object] = (), name: str = ""
) -> Object:
    """Return the mesh object on which an object's curves grow. Raises `HairError`.

    In order: the mesh object with a given name, the surface of the curves, the only mesh among the selected objects,
    the curves' parent, or the only mesh in the file.
    """
    if name:
        found = view_layer.objects.get(name)
        if found is None or found.type != "MESH":
            raise HairError('There is no mesh object "{name}".', name=name)
        return found
    surface = getattr(curves_object.data, "surface", None)
    if surface is not None and surface.type == "MESH":
        return surface
    beside = [o for o in selected if o.type == "MESH"]
    if len(beside) > 1:
        raise HairError("Several meshes are selected: select the curves and the one mesh that they grow on.")
    if beside:
        return beside[0]
    parent = curves_object.parent
    while parent is not None and parent.type != "MESH":
        parent = parent.parent
    if parent is not None:
        return parent
    meshes = [o for o in view_layer.objects if o is not None and o.type == "MESH"]
    if len(meshes) != 1:
        raise HairError("Select the mesh that the curves grow on, and then the curves.")
    return meshes[0]


@whole_changes.whole
def using_as_guides(
    curves_object: Object,
    surface_object: Object,
    depsgraph: Depsgraph,
    *,
    every: int = 1,
    applies_modifiers: bool = True,
    hair_settings: HairSettings | None = None,
) -> Work[HandMade]:
    """Work that converts the curves of an object to guides, and returns `HandMade`.

    every: keep every n-th curve; applies_modifiers: use evaluated curves, not stored ones; hair_settings: of hair
    grown between the guides, None for no hair. Without a mask in the settings, and if the curves do not cover the whole
    surface, hair gets a new vertex group painted around the curves. Raises `HairError` before anything changes.
    """
    every = grooming.rooted_curves.checked_every(every)
    applies_modifiers = plain_value("Apply Modifiers", applies_modifiers, True, _SWITCH)
    surface, seen, to_surface = open_curves(curves_object, surface_object, depsgraph, applies_modifiers)
    is_unmasked = hair_settings is not None and not masks.own(hair_settings)
    grow = None if hair_settings is None else pipeline.hair_between(surface_object, surface, hair_settings, depsgraph)
    place, its_surface, device = Remembered(curves_object), Remembered(surface_object), preferences.device()

    def compute(progress):
        progress("Rooting guides", 0.0)
        guides = on_surface(surface, seen, to_surface, every)
        if grow is None:
            return guides, None
        there = strands.from_numpy(guides.even(surface), guides.rooted.roots, device)
        density = None
        if is_unmasked:
            density = _coverage(surface.mesh, positions(surface.mesh, guides.rooted.roots))
        return guides, grow(there, part_of(progress, 0.2, 1.0), density)

    guides, bound = yield compute
    if bound is not None and is_unmasked and _area(its_surface.find(), surface, guides.rooted.roots) is not None:
        usable_surfaces.require_paintable(its_surface.find())
    datablock = write(place.find(), its_surface.find(), surface, guides, seen, applies_modifiers)
    if bound is not None and is_unmasked:
        _bind_to_group(bound, datablock.surface, surface, guides.rooted.roots)
    hair = None if bound is None else pipeline.write_between(datablock, bound)
    return HandMade(datablock, hair, guides.rooted)


def open_curves(
    curves_object: Object, surface_object: Object, depsgraph: Depsgraph, applies_modifiers: bool
) -> tuple[Surface, SeenCurves, Affine]:
    """Return a surface, the curves of an object, and the `Affine` from their coordinates to the surface's.

    applies_modifiers: as in `using_as_guides`. Raises `HairError`, also for an object without curves.
    """
    require_usable(curves_object, surface_object)
    curves_objects.store_rest_positions(surface_object)
    surface = scene.read_surface(surface_object, depsgraph)
    seen = foreign_curves.read(curves_object, applies_modifiers)
    if len(seen.starts) < 2:
        raise HairError('"{name}" has no curves yet: draw some with the Add brush.', name=name_of(curves_object))
    return surface, seen, surface_space.between(curves_object, surface_object)


def require_usable(curves_object: Object, surface_object: Object) -> None:
    """Raise `HairError` unless an object's curves can be attached to a mesh object."""
    foreign_curves.require_editable(curves_object)
    curves.require_overridable(surface_object)
    usable_surfaces.require_evaluated(surface_object)
    ancestor = surface_object
    while ancestor is not None:
        if ancestor == curves_object:
            raise HairError('"{name}" is parented to its own curves: clear its parent.', name=name_of(surface_object))
        ancestor = ancestor.parent


def on_surface(
    surface: Surface, seen: SeenCurves, to_surface: Affine, every: int = 1, is_directed: bool = False
) -> PlacedCurves:
    """Return `PlacedCurves`; to_surface: from the curves' coordinates to those of the surface.

    every, is_directed: as of `rooted_curves.root`.
    """
    points = to_surface.points(seen.points)
    mesh = surface.mesh
    if surface.is_deformed:
        mesh = TriMesh(surface.from_local(surface.posed), mesh.triangles)
    with np.errstate(invalid="ignore", over="ignore"):
        rooted = grooming.rooted_curves.root(mesh, surface.from_local(points), seen.starts, every, is_directed)
    points = points[rooted.point_order(seen.starts)]
    counts = np.diff(seen.starts)[rooted.kept]
    if surface.is_deformed:
        places = surface.places(rooted.roots)
        motion = posed_strands.pose_of(surface).motion_at(places[0])
        points = posed_strands.carried(points, motion, places, counts, is_back=True)
    return PlacedCurves(points, counts, seen.is_smooth[rooted.kept], rooted, to_surface)


def _coverage(mesh, roots):
    return placement.coverage.coverage(mesh, roots)


def _paint(surface_object, weights):
    """Create a vertex group of weights (V,), which can be painted; returns its name. Raises `HairError`."""
    usable_surfaces.require_paintable(surface_object)
    group = surface_object.vertex_groups.new(name=_GROUP)
    vertex_groups.paint(group, weights, leaves_out_zero=False)
    bpy.context.view_layer.update()
    return group.name


def paint_area(surface_object: Object, surface: Surface, roots: SurfacePoints) -> str:
    """Create a vertex group of the area around roots of guides; returns its name, empty if that is the whole mesh."""
    weights = _area(surface_object, surface, roots)
    return "" if weights is None else _paint(surface_object, weights)


def _area(surface_object, surface, roots):
    """Return the (V,) weights of the area around roots at an object's own vertices; None if it is the whole mesh."""
    own_mesh = scene.read_own_mesh(surface_object, surface.to_world_axes)
    return _coverage(own_mesh, positions(surface.mesh, roots))


def _bind_to_group(bound, surface_object, surface, roots):
    """Set the vertex group of the area with guides as the mask of their hair."""
    name = paint_area(surface_object, surface, roots)
    if not name:
        return
    bound.settings = replace(bound.settings, density_group=name)
    painted = scene.read_cage_weights(surface_object, scene.present_depsgraph(), name)
    bound.root_key = staleness.root_key(bound.settings, painted)


def write(
    curves_object: Object,
    surface_object: Object,
    surface: Surface,
    placed: PlacedCurves,
    seen: SeenCurves,
    applies_modifiers: bool,
    kind: str = "GUIDES",
) -> bpy.types.Curves:
    """Convert an object's curves to hand-made GUIDES or HAIR; returns its Curves. Raises `HairError`."""
    whole_changes.keep_copy(curves_object)
    datablock = foreign_curves.take(curves_object, applies_modifiers)
    if len(datablock.points) != seen.starts[-1]:
        raise HairError('"{name}" was changed while its guides were being computed.', name=name_of(curves_object))
    rooted = placed.rooted
    if len(rooted.kept) < len(datablock.curves):
        unused = np.setdiff1d(np.arange(len(datablock.curves)), rooted.kept)
        datablock.remove_curves(indices=unused.tolist())
    if rooted.reversed_count:
        attributes.reorder_points(datablock, reversal(placed.counts, rooted.is_reversed))
    _put_on(curves_object, surface_object, is_rendered=kind == "HAIR")
    datablock.surface = surface_object
    datablock.vellus.kind = kind
    attributes.write(datablock, "position", "FLOAT_VECTOR", "POINT", placed.points)
    if attributes.has(datablock, "radius", "FLOAT", "POINT"):
        curves.widen(datablock, placed.to_surface)
    datablock.vellus.written = curves.BY_HAND
    curves.write_roots(datablock, surface, rooted.roots)
    # Distance in local units up to which first points are up to date (`curves.read_roots`).
    attributes.write(datablock, "root_distance", "FLOAT", "CURVE", rooted.distances / surface.scale)
    surface_space.keep_surface(datablock, surface)
    return datablock


def _put_on(curves_object, surface_object, is_rendered):
    """Parent an object to its surface, with the surface's coordinates and no other transforms."""
    curves_objects.attach_to_surface(curves_object, surface_object)
    for constraint in curves_object.constraints:
        constraint.enabled = False
    curves_objects.render(curves_object, is_rendered=is_rendered)
    follow_nodes.add_modifier(curves_object)
