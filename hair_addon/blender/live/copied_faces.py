# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair follows surfaces whose modifiers begin to copy faces, or copy other faces, and grows on the copies too.

Nodes separate the copies at rest (data/rest_nodes.py). Blender evaluates a handler's changes without calling handlers
again, so the view layer is updated here, at the end of the handler.
"""

import bpy

from ...core.errors import HairError
from ..data import rest_nodes, scene
from ..data.strands import curves
from ..data.surfaces import cage_of
from ..groom import bindings


def separate_copies(surface_object):
    """Add, move or remove the nodes of a surface; returns whether they changed, so that `follow` must be called."""
    if not surface_object.add_rest_position_attribute or not _on(surface_object):
        return False
    return rest_nodes.separate_copies(surface_object)


def follow(surfaces, view_layer):
    """Update hair on surfaces whose nodes have changed, and spread it over new faces."""
    cages = {part.session_uid: cage_of(part.vellus.topology) for one in surfaces for part in _on(one)}
    for surface_object in surfaces:
        surface_object.update_tag()
    view_layer.update()  # combed strands are carried
    grown = [part for one in surfaces for part in _grown_anew(one, cages)]
    for part in grown:
        bindings.invalidate(part)
        part.vellus.root_key = ""  # places new roots
        part.vellus.is_stale = True
        part.update_tag()
    if grown:
        view_layer.update()


def _grown_anew(surface_object, cages):
    """Uncombed guides and hair on a surface whose faces have changed.

    cages: {session_uid: cage of the faces that the part was grown on}.
    """
    parts = [one for one in _on(surface_object) if one.vellus.is_live and not curves.is_combed(one)]
    try:
        cage = cage_of(scene.read_surface(surface_object, scene.present_depsgraph()).topology)
    except HairError:  # without faces, which the status reports
        return []
    return [one for one in parts if cages.get(one.session_uid, cage) != cage]


def _on(surface_object):
    return [one for one in bpy.data.hair_curves if one.surface == surface_object and one.vellus.kind != "NONE"]
