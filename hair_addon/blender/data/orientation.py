# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces that are inside out: closed meshes whose normals point inward, where hair grows inward too."""

from ...core.geometry import orientation
from ..host.caches import Cache
from ..host.notices import name_of
from . import scene

inside_out_cache = Cache()  # session_uid of a mesh → whether it is inside out


def is_inside_out(mesh_object):
    """Whether the mesh of an object, before its modifiers, is closed and its normals point inward.

    Hair grows out of mirrored objects as out of others, as Blender draws them: their scale does not matter. The mesh is
    read once after each edit.
    """
    mesh = mesh_object.data
    return inside_out_cache.get(mesh.session_uid, lambda: _is_inside_out(mesh))


def _is_inside_out(mesh):
    if not orientation.is_closed(scene.corner_values(mesh, ".corner_edge"), len(mesh.edges)):
        return False
    return orientation.signed_volume(scene.vertex_positions(mesh), scene.faces_of(mesh)) < 0.0


def warning(mesh_object):
    """(sentence, values) about a mesh that is inside out, for scripts and commands; None where it is not."""
    if not is_inside_out(mesh_object):
        return None
    return '"{name}" is inside out: hair grows inward. Flip the normals of its mesh.', {"name": name_of(mesh_object)}


def mesh_changed(mesh):
    """Forget what was read of a mesh that was edited."""
    inside_out_cache.invalidate(mesh.session_uid)
