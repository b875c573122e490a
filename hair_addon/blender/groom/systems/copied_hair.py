# SPDX-License-Identifier: GPL-3.0-or-later
"""Copies of hair: their surface and guides, and guides that several hair objects share.

If objects are duplicated together, Blender makes their copies refer to each other. Make Single User copies only data:
the copies refer to the original surface and guides, although their objects are on another surface with other guides.
"""

from collections.abc import Sequence

import bpy
from bpy.types import Curves, Depsgraph, Object

from ....core.errors import HairError
from ...data import scene, surface_space, whole_changes
from ...data.strands import curves, curves_objects
from ...host.caches import Cache
from ...host.notices import name_of
from .. import staleness
from ..selection import followers_shown

known_cache = Cache()  # "Curves" → session UIDs of guides and hair at the last check


def remember() -> None:
    """Accept the present Curves as they are, as after opening a file, appending or undo."""
    known_cache.clear()
    if uids := frozenset(datablock.session_uid for datablock in _ours()):
        known_cache.keep("Curves", uids)


def follow() -> list[Curves]:
    """Attach Curves that were copied since the last call to the surface of their objects, and to its guides.

    Returns the copies.
    """
    known, ours = known_cache.get("Curves"), _ours()
    if (known or frozenset()) == frozenset(datablock.session_uid for datablock in ours):
        return []
    remember()
    new = [] if known is None else [datablock for datablock in ours if datablock.session_uid not in known]
    if not new:
        return []
    users = _users()
    for datablock in new:
        surface = _surface_beside(datablock, users.get(datablock, ()))
        if surface is not None:
            datablock.surface = surface
            surface_space.remember_place(datablock)
            datablock.update_tag()
    for hair in ours:
        if hair.vellus.kind == "HAIR" and hair.vellus.guide_curves is not None:
            guides = _guides_beside(hair, new, users)
            if guides is not None:
                _let_follow(hair, guides)
    return new


def _ours() -> list[Curves]:
    backups = whole_changes.backup_copies()
    ours = (one for one in bpy.data.hair_curves if one.vellus.kind != "NONE" and one.library is None)
    return [one for one in ours if one.session_uid not in backups]


def _users() -> dict[Curves, list[Object]]:
    found: dict[Curves, list[Object]] = {}
    backups = whole_changes.backup_copies()
    for user in bpy.data.objects:
        if user.type == "CURVES" and user.session_uid not in backups:
            found.setdefault(user.data, []).append(user)
    return found


def _surface_beside(datablock, users):
    """Return the parent of all objects of Curves if it is a copy of their surface; else None."""
    parents, surface = {user.parent for user in users}, datablock.surface
    if len(parents) != 1 or surface is None or surface in parents or surface.type != "MESH":
        return None
    (parent,) = parents
    if parent is None or parent.type != "MESH":
        return None
    sizes = [(len(one.data.vertices), len(one.data.loops), len(one.data.polygons)) for one in (parent, surface)]
    return parent if sizes[0] == sizes[1] else None


def _guides_beside(hair, new, users):
    """Return a copy of the followed guides on the hair's surface, if hair follows guides elsewhere or was copied."""
    followed = hair.vellus.guide_curves
    if hair not in new and followed.surface == hair.surface:
        return None
    if followed in new:
        return None
    beside = [
        one
        for one in users
        if one.vellus.kind == "GUIDES" and one.surface == hair.surface and one not in (followed, None)
    ]
    copies = [one for one in beside if one in new or not curves.followers(one)]
    digest = staleness.guides_digest(followed) if copies else ""
    alike = [one for one in copies if staleness.guides_digest(one) == digest]
    return min(alike, key=lambda one: (one not in new, one.session_uid), default=None)


def _let_follow(hair, guides):
    """Let hair follow identical guides, without marking it stale."""
    was_stale = hair.vellus.is_stale
    hair.vellus.guide_curves = guides
    hair.vellus.is_stale = was_stale


def sharing(hair: Curves) -> list[Curves]:
    """Other hair Curves in scenes that follow the same guides."""
    guides = hair.vellus.guide_curves
    return [] if guides is None else [one for one in followers_shown(guides) if one != hair]


def are_elsewhere(hair: Curves) -> bool:
    """Whether hair follows guides on a different surface."""
    guides = hair.vellus.guide_curves
    return guides is not None and None not in (guides.surface, hair.surface) and guides.surface != hair.surface


def make_own_guides(hair_list: Sequence[Curves], depsgraph: Depsgraph) -> list[Curves]:
    """Copy the guides of hair to its surface, let it follow the copies, and return them. Raises `HairError`.

    Hair that shared guides on another surface shares their copy.
    """
    for hair in hair_list:
        curves.require_editable(hair)
        if hair.vellus.guide_curves is None:
            raise HairError('"{name}" has no guides: pick them in the Strands panel.', name=name_of(hair))
        if hair.surface is None:
            raise HairError("The surface is missing: pick a mesh.")
    surfaces = {hair.surface: scene.read_surface(hair.surface, depsgraph) for hair in hair_list}
    made: dict[tuple[Curves, Object], Curves] = {}
    for hair in hair_list:
        key = hair.vellus.guide_curves, hair.surface
        is_same = not are_elsewhere(hair) or _is_same_shape(key[0].surface, surfaces[hair.surface], depsgraph)
        if key not in made:
            made[key] = _copied(*key, surfaces[hair.surface])
        if is_same:
            _let_follow(hair, made[key])
        else:  # marks the hair stale: its strands are rooted on the other surface
            hair.vellus.guide_curves = made[key]
    return list(made.values())


def _is_same_shape(surface_object, surface, depsgraph):
    try:
        return scene.read_surface(surface_object, depsgraph).is_same_shape(surface)
    except HairError:  # unreadable surfaces count as different
        return False


def _copied(guides, surface_object, surface):
    own = guides.copy()
    own.surface = surface_object
    own.vellus.cache_identity = own.vellus.delivered_key = ""  # identifies the baked frames of the original
    surface_space.forget_applied(own)
    curves_objects.link_object(name_of(guides), own, surface_object, is_rendered=False)
    roots = curves.read_roots(own, surface, surface.from_local(curves.first_points(own)))
    curves.write_roots(own, surface, roots, firsts=curves.first_points(own))
    surface_space.keep_surface(own, surface)
    return own
