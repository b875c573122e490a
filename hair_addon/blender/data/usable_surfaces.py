# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks that a mesh object can have hair: it exists, is evaluated, is not in Edit Mode, and can be painted."""

import bpy

from ...core.errors import HairError
from ..host.notices import name_of


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


def require_object_mode(surface_object):
    """Raise `HairError` for a mesh object in Edit Mode, whose edited mesh is stored elsewhere."""
    if surface_object.mode == "EDIT":
        raise HairError('"{name}" is in Edit Mode: leave it first.', name=name_of(surface_object))


def require_paintable(surface_object):
    """Raise `HairError` for a linked mesh: a new vertex group would be lost when the file is opened again."""
    if surface_object.data.library is not None:
        sentence = 'The mesh of "{name}" is linked from another file and cannot store a new mask: make the mesh local.'
        raise HairError(sentence, name=name_of(surface_object))
