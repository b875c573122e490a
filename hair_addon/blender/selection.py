# SPDX-License-Identifier: GPL-3.0-or-later
"""What an operator works on, given the active object: its surface, the guides on that, the hair that follows them."""

import bpy

from .curves import followers


def active_of_kind(active, kind):
    """The Curves of the active object if they are ours and of this kind, GUIDES or HAIR; else None."""
    if active is not None and active.type == "CURVES" and active.data.vellus.kind == kind:
        return active.data
    return None


def surface_of(active):
    """The mesh object that is active, or that the active guides or hair grow on; None if there is none."""
    if active is None:
        return None
    if active.type == "MESH":
        return active
    return active.data.surface if active.type == "CURVES" else None


def guides_again(active):
    """The guides that distributing again would replace: the active ones, or the active hair's; None on a mesh."""
    hair = active_of_kind(active, "HAIR")
    return active_of_kind(active, "GUIDES") if hair is None else hair.vellus.guide_curves


def guides_of(active):
    """The active guides, the active hair's guides, or the newest guides on the active mesh; None if there are none."""
    if active is None or active.type != "MESH":
        return guides_again(active)
    return _newest(curves_on(active, "GUIDES"))


def hair_of(active):
    """The active hair, the newest that follows the active guides, or the newest on the active mesh; None if none."""
    if active is None:
        return None
    if active.type == "MESH":
        return _newest(curves_on(active, "HAIR"))
    guides = active_of_kind(active, "GUIDES")
    return active_of_kind(active, "HAIR") if guides is None else _newest(followers(guides))


def curves_on(surface, kind):
    """Every guide or hair Curves datablock on a mesh object."""
    return [c for c in bpy.data.hair_curves if c.vellus.kind == kind and c.surface == surface]


def parts_of(active):
    """The Curves that stand or fall together: the active guides and their hair, or the active hair and its guides if
    no other hair follows those, or all on the active mesh."""
    hair, guides = active_of_kind(active, "HAIR"), active_of_kind(active, "GUIDES")
    if hair is not None:
        its_guides = hair.vellus.guide_curves
        return [hair] if its_guides is None or followers(its_guides) != [hair] else [hair, its_guides]
    if guides is not None:
        return [guides, *followers(guides)]
    if active is None or active.type != "MESH":
        return []
    return curves_on(active, "GUIDES") + curves_on(active, "HAIR")


def drawn_with(active):
    """The hair that drawing is switched on and off for: the active one, or all in the file."""
    hair = active_of_kind(active, "HAIR")
    return [c for c in bpy.data.hair_curves if c.vellus.kind == "HAIR"] if hair is None else [hair]


def mesh_to_attach_to(context):
    """The mesh object that active guides or hair are to grow on: the one selected beside them, or their surface."""
    if not any(active_of_kind(context.object, kind) for kind in ("GUIDES", "HAIR")):
        return None
    selected = next((o for o in context.selected_objects if o.type == "MESH"), None)
    return selected or context.object.data.surface


def object_of(curves, view_layer):
    """The first object of a view layer that shows Curves; None if there is none."""
    return next((o for o in _there(view_layer) if o.data == curves), None)


def make_active(chosen, view_layer):
    """Select an object and nothing else."""
    for other in _there(view_layer):
        other.select_set(other == chosen)
    view_layer.objects.active = chosen


def _there(view_layer):
    """The objects of a view layer; those that a script has just removed are listed as None until the next update."""
    return [o for o in view_layer.objects if o is not None]


def _newest(candidates):
    return max(candidates, key=lambda curves: curves.session_uid, default=None)
