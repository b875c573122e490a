# SPDX-License-Identifier: GPL-3.0-or-later
"""What an operator works on, given the active object."""

import bpy


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
    on_mesh = [c for c in bpy.data.hair_curves if c.vellus.kind == "GUIDES" and c.surface == active]
    return max(on_mesh, key=lambda curves: curves.session_uid, default=None)
