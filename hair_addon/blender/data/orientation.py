# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces that are inside out: closed meshes whose normals point inward, so that hair grows inward."""

from ...core.geometry import orientation
from ..host.caches import Cache
from ..host.notices import name_of
from . import scene

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


def warning(mesh_object):
    """(sentence, values) for scripts and commands if a mesh is inside out, else None."""
    if not is_inside_out(mesh_object):
        return None
    return '"{name}" is inside out: hair grows inward. Flip the normals of its mesh.', {"name": name_of(mesh_object)}


def mesh_changed(mesh):
    """Forget the orientation of an edited mesh."""
    inside_out_cache.invalidate(mesh.session_uid)
