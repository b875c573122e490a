# SPDX-License-Identifier: GPL-3.0-or-later
"""Operations on existing hair: deletion, UV maps, repairs."""

from collections.abc import Iterable

import bpy
import numpy as np
from bpy.types import Curves, Depsgraph, Object, ViewLayer

from ....core.errors import HairError
from ....core.geometry import mesh
from ....core.geometry.faces import uv_maps
from ...data import scene, surface_space
from ...data.strands import curves, curves_objects
from ...host.notices import name_of
from ...materials import materials
from ..selection import curves_on
from ..surfaces import edited_surfaces

_UV_MAP = "Hair"

_LARGEST_UNWRAPPED = 1e9  # in local units: unwrapping a mesh of size 1e12 never ends in Blender

# Roots on seams may be found on either side of them.
_TOLERATED = 0.002


def delete(parts: Iterable[Curves]) -> None:
    """Remove guide or hair Curves with their objects, and materials and guides that become unused."""
    for part in parts:
        curves.require_editable(part)
    guides = {part.vellus.guide_curves for part in parts} - {None, *parts}
    made = {m for part in parts for m in part.materials if m is not None and materials.is_hair_material(m)}
    for user in [o for o in bpy.data.objects if o.data in parts]:
        bpy.data.objects.remove(user)
    for part in parts:
        bpy.data.hair_curves.remove(part)
    for material in [m for m in made if m.users == 0]:
        bpy.data.materials.remove(material)
    for left in [g for g in guides if g.users == 0]:
        bpy.data.hair_curves.remove(left)
    bpy.context.view_layer.update()  # otherwise it still lists deleted objects as None


def restore_object(guides: Curves) -> Object:
    """Create a new object for guides whose object was deleted while hair still follows them."""
    curves.require_overridable(guides)
    if guides.surface is None:
        raise HairError("The surface is missing: pick a mesh.")
    return curves_objects.link_object(guides.name, guides, guides.surface, is_rendered=False)


def make_uv_map(surface_object: Object, view_layer: ViewLayer) -> None:
    """Unwrap a mesh object to an additional UV map, and update the hair on it."""
    curves.require_overridable(surface_object)
    curves.require_editable(surface_object.data)
    if not surface_object.data.polygons:
        raise HairError("The surface has no faces to grow hair on.")
    if not surface_object.visible_get(view_layer=view_layer):
        raise HairError('"{name}" is hidden: show it first.', name=name_of(surface_object))
    if np.ptp(scene.vertex_positions(surface_object.data), axis=0).max() > _LARGEST_UNWRAPPED:
        raise HairError('"{name}" is too large to unwrap: scale its mesh down.', name=name_of(surface_object))
    if surface_object.data.uv_layers.new(name=_UV_MAP) is None:
        raise HairError('"{name}" has no room for another UV map: remove one.', name=name_of(surface_object))
    surface_object.data.uv_layers.active_index = len(surface_object.data.uv_layers) - 1
    active = view_layer.objects.active
    view_layer.objects.active = surface_object
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.uv.smart_project(island_margin=0.005)
    bpy.ops.object.mode_set(mode="OBJECT")
    view_layer.objects.active = active
    view_layer.update()
    renew_uvs(surface_object, bpy.context.evaluated_depsgraph_get())


def renew_uvs(surface_object: Object, depsgraph: Depsgraph) -> None:
    """Write the UV coordinates of the roots of all hair on a mesh object from its active UV map."""
    surface, parts = scene.read_surface(surface_object, depsgraph), _parts_on(surface_object)
    for part in parts:
        curves.require_editable(part)
    for part in parts:
        curves.write_uvs(part, surface)
        part.vellus.uv_status = ""


def _parts_on(surface_object):
    return curves_on(surface_object, "GUIDES") + curves_on(surface_object, "HAIR")


def check_uvs(surface_object: Object, depsgraph: Depsgraph) -> float:
    """Return the fraction, in [0, 1], of a mesh object's surface with bad UVs, and store the problem with its hair."""
    surface = scene.read_surface(surface_object, depsgraph)
    mesh.check_mesh(surface.mesh)
    if surface.corner_uvs is None:
        raise HairError('"{name}" has no UV map: make one.', name=name_of(surface_object))
    share = uv_maps.misleading_fraction(surface.mesh, surface.corner_uvs)
    for part in _parts_on(surface_object):
        part.vellus.uv_status = "UVs overlap" if share > _TOLERATED else ""
    return share


def flip_normals(surface_object: Object, view_layer: ViewLayer) -> None:
    """Flip the faces of a mesh object; uncombed guides are regenerated on the other side."""
    curves.require_overridable(surface_object)
    curves.require_editable(surface_object.data)
    grown = [guides for guides in curves_on(surface_object, "GUIDES") if not curves.is_combed(guides)]
    surface_object.data.flip_normals()
    surface_object.data.update()
    view_layer.update()  # roots the guides again
    for guides in grown:
        guides.vellus.is_stale = True
        guides.update_tag()
    view_layer.update()


def apply_scale(surface_object: Object, view_layer: ViewLayer) -> None:
    """Apply a mesh object's scale, and keep its guides in place; hair follows them again."""
    curves.require_overridable(surface_object)
    curves.require_editable(surface_object.data)
    if surface_object.data.users > 1:
        raise HairError(
            '"{name}" shares its mesh with another object: make it single-user.', name=name_of(surface_object)
        )
    scale = tuple(surface_object.scale)
    if not all(scale):
        raise HairError('"{name}" has a scale of zero: change its scale.', name=name_of(surface_object))
    all_guides = curves_on(surface_object, "GUIDES")  # including guides without live updates
    for guides in all_guides:
        curves.require_editable(guides)
    to_world_before = surface_space.to_world(surface_object)
    with bpy.context.temp_override(
        active_object=surface_object,
        object=surface_object,
        selected_objects=[surface_object],
        selected_editable_objects=[surface_object],
    ):
        bpy.ops.object.transform_apply(location=False, rotation=False, scale=True)
    view_layer.update()
    for guides in all_guides:
        edited_surfaces.follow_surface(guides, bpy.context.evaluated_depsgraph_get(), to_world_before)
