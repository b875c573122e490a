# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks that a mesh object can have hair: it exists, is evaluated, is not in Edit Mode, and can be painted."""

import bpy
import numpy as np

from ...core.errors import HairError
from ...core.geometry.faces import orientation
from ..host.caches import Cache
from ..host.notices import name_of
from . import scene


def is_deleted(surface_object):
    """Whether a mesh object was deleted, and only its hair still references it: it is in no collection.

    Panels call this with every redraw: looking up a name in a view layer is fast, searching collections is not.
    """
    view_layer = bpy.context.view_layer
    if view_layer is not None and view_layer.objects.get(name_of(surface_object)) == surface_object:
        return False
    return surface_object.library is None and not surface_object.users_collection


def require_evaluated(surface_object):
    """Raise `HairError` for a mesh object that is not evaluated: in another scene, or hidden in viewports."""
    if not surface_object.evaluated_get(bpy.context.evaluated_depsgraph_get()).is_evaluated:
        sentence = '"{name}" is hidden in viewports or is not in this scene: show it or link it.'
        raise HairError(sentence, name=name_of(surface_object))


def is_in(surface_object, depsgraph):
    """Whether an object is not only in other scenes than a depsgraph, which has its mesh without modifiers there."""
    if surface_object.evaluated_get(depsgraph).is_evaluated:
        return True
    scenes = surface_object.users_scene
    return not scenes or depsgraph.scene in scenes


def require_object_mode(surface_object):
    """Raise `HairError` for a mesh object in Edit Mode, whose edited mesh is stored elsewhere."""
    if surface_object.mode == "EDIT":
        raise HairError('"{name}" is in Edit Mode: leave it first.', name=name_of(surface_object))


def require_paintable(surface_object):
    """Raise `HairError` for a linked mesh: a new vertex group would be lost when the file is opened again."""
    if surface_object.data.library is not None:
        sentence = 'The mesh of "{name}" is linked from another file and cannot store a new mask: make the mesh local.'
        raise HairError(sentence, name=name_of(surface_object))


inside_out_cache = Cache()  # session_uid of a mesh → whether it is inside out


def is_inside_out(mesh_object):
    """Whether the mesh of an object, before its modifiers, is closed and its normals point inward.

    The object's scale does not matter: hair grows out of mirrored objects too. The mesh is read once after each edit.
    """
    mesh = mesh_object.data
    return inside_out_cache.get(mesh.session_uid, lambda: _is_inside_out(mesh))


def _is_inside_out(mesh):
    if not orientation.is_closed(scene.corner_values(mesh, ".corner_edge"), len(mesh.edges)):
        return False
    return orientation.signed_volume(scene.vertex_positions(mesh), scene.faces_of(mesh)) < 0.0


def inside_out_warning(mesh_object):
    """Return (sentence, values) for scripts and commands if a mesh is inside out, else None."""
    if not is_inside_out(mesh_object):
        return None
    return '"{name}" is inside out: hair grows inward. Flip the normals of its mesh.', {"name": name_of(mesh_object)}


def forget_orientation(mesh):
    """Forget the orientation of an edited mesh."""
    inside_out_cache.invalidate(mesh.session_uid)


def is_whole(mesh):
    """Whether all corner and vertex indices of a mesh's faces are valid."""
    corners = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    starts, totals = (np.empty(len(mesh.polygons), np.int32) for _ in range(2))
    mesh.polygons.foreach_get("loop_start", starts)
    mesh.polygons.foreach_get("loop_total", totals)
    ends = starts.astype(np.int64) + totals
    is_whole = corners.min(initial=0) >= 0 and corners.max(initial=-1) < len(mesh.vertices)
    return is_whole and min(starts.min(initial=0), totals.min(initial=0)) >= 0 and ends.max(initial=0) <= len(corners)
