# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces whose modifiers begin to copy faces, or copy others: hair grows on the copies too, at once.

Nodes tell the copies apart at rest (data/rest_nodes.py). Blender evaluates what a handler changes without calling
handlers again, so it is asked to here, when the handler has done all else.
"""

import bpy

from ...core.errors import HairError
from ..data import rest_nodes, scene
from ..data.strands import curves
from ..data.surfaces import cage_of
from ..groom import bindings


def tell_apart(surface_object):
    """Whether nodes were added to a surface of our hair, moved or removed, so that `follow` has to be called."""
    if not surface_object.add_rest_position_attribute or not _on(surface_object):
        return False
    return rest_nodes.tell_apart(surface_object)


def follow(surfaces, view_layer):
    """Bring hair up to date with surfaces whose nodes have changed, and spread it over faces that are new."""
    cages = {part.session_uid: cage_of(part.vellus.topology) for one in surfaces for part in _on(one)}
    for surface_object in surfaces:
        surface_object.update_tag()
    view_layer.update()  # which carries what is combed
    grown = [part for one in surfaces for part in _grown_anew(one, cages)]
    for part in grown:
        bindings.invalidate(part)
        part.vellus.root_key = ""  # so that roots are placed anew
        part.vellus.is_stale = True
        part.update_tag()
    if grown:
        view_layer.update()


def _grown_anew(surface_object, cages):
    """Guides and hair that nobody combed, on a surface that has other faces than theirs were; cages: of these."""
    parts = [one for one in _on(surface_object) if one.vellus.is_live and not curves.is_combed(one)]
    try:
        cage = cage_of(scene.read_surface(surface_object, scene.present_depsgraph()).topology)
    except HairError:  # without faces, which the status says
        return []
    return [one for one in parts if cages.get(one.session_uid, cage) != cage]


def _on(surface_object):
    return [one for one in bpy.data.hair_curves if one.surface == surface_object and one.vellus.kind != "NONE"]
