# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether a mesh object can take grooms: Blender evaluates it, it is not in Edit Mode, and its mesh can be painted."""

import bpy

from ...core.errors import HairError
from ..host.notices import name_of


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
