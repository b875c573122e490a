# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether a mesh object can take grooms: it is there, evaluated, not in Edit Mode, and its mesh can be painted."""

import bpy

from ...core.errors import HairError
from ..host.notices import name_of


def is_deleted(surface_object):
    """Whether a mesh object was deleted, and is only kept by the hair that grows on it: it is in no collection.

    Panels ask with every redraw: a view layer finds an object by its name at once, collections are searched.
    """
    view_layer = bpy.context.view_layer
    if view_layer is not None and view_layer.objects.get(name_of(surface_object)) == surface_object:
        return False
    return surface_object.library is None and not surface_object.users_collection


def require_evaluated(surface_object):
    """Raise `HairError` for a mesh object of another scene or hidden in viewports: its modifiers are not evaluated."""
    if not surface_object.evaluated_get(bpy.context.evaluated_depsgraph_get()).is_evaluated:
        sentence = '"{name}" is hidden in viewports or is not in this scene: show it or link it.'
        raise HairError(sentence, name=name_of(surface_object))


def require_object_mode(surface_object):
    """Raise `HairError` for a mesh object in Edit Mode, where Blender keeps its mesh elsewhere."""
    if surface_object.mode == "EDIT":
        raise HairError('"{name}" is in Edit Mode: leave it first.', name=name_of(surface_object))


def require_paintable(surface_object):
    """Raise `HairError` for a mesh that is linked: a new vertex group would be lost when the file is opened again."""
    if surface_object.data.library is not None:
        sentence = 'The mesh of "{name}" is linked from another file and cannot store a new mask: make the mesh local.'
        raise HairError(sentence, name=name_of(surface_object))
