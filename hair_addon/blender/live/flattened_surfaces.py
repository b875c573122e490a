# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces with a scale of zero: their guides and hair follow changes only once the scale is not zero."""

from ...core.errors import HairError
from ..data import scene, surface_space
from ..host.caches import Cache

# session_uid of a surface whose scale is zero → whether its mesh was edited meanwhile.
edited_cache = Cache()


def note(surface_object, is_edited):
    """Return whether a reported surface has a scale of zero; remember it, and whether its mesh was edited."""
    if not surface_space.is_flattened(surface_object):
        return False
    uid = surface_object.session_uid
    edited_cache.keep(uid, bool(edited_cache.get(uid)) or is_edited)
    return True


def restored(surfaces):
    """Return {surface whose scale is not zero any more: whether its mesh was edited meanwhile}, and forget them."""
    found = {}
    for surface_object in surfaces if len(edited_cache) else ():
        was_edited = edited_cache.get(surface_object.session_uid)
        if was_edited is not None and not surface_space.is_flattened(surface_object):
            found[surface_object] = was_edited
            edited_cache.invalidate(surface_object.session_uid)
    return found


def is_waiting(curves):
    """Whether Curves wait for another scale of their surface; their status says so."""
    if curves.surface is None:
        return False
    try:
        scene.require_scale(curves.surface)
    except HairError as error:
        if curves.vellus.status != str(error):  # a write of the same text would be reported as a change
            curves.vellus.status = str(error)
        return True
    return False
