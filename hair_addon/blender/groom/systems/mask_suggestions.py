# SPDX-License-Identifier: GPL-3.0-or-later
"""Suggested mask for new hair: a vertex group chosen by its name."""

import bpy
from bpy.types import Object

from ....core.grooming import mask_names
from ...data import masks
from ...data.vertex_groups import has_weights
from ...host.notices import text_of


def mask_of(surface: Object) -> str:
    """Return the mask that an artist has chosen for new hair on a mesh object, or else the suggested one."""
    state = surface.vellus
    chosen = text_of(state, "new_hair_mask")
    if state.has_new_hair_mask:
        return chosen if chosen in surface.vertex_groups else ""
    return suggested(surface)


def suggested(surface: Object) -> str:
    """Return the name of a vertex group named after hair, without a bone and unused by hair; empty if there is none."""
    names = [group.name for group in surface.vertex_groups]
    if not names:
        return ""
    on_surface = [curves for curves in bpy.data.hair_curves if curves.users and curves.surface == surface]
    used = {masks.of_curves(curves).group for curves in on_surface if curves.vellus.kind != "NONE"}
    rigs = [modifier.object for modifier in surface.modifiers if modifier.type == "ARMATURE"]
    bones = {bone.name for rig in rigs if rig is not None for bone in rig.data.bones}
    return mask_names.suggested(name for name in names if name not in used | bones)


def filled(surface: Object) -> str:
    """Return `mask_of` a mesh object if the group has any weights, else an empty name."""
    name = mask_of(surface)
    return name if name and has_weights(surface, name) else ""


def forget_choice(surface: Object) -> None:
    """Suggest a mask again after new hair has grown in the chosen group."""
    if surface.vellus.has_new_hair_mask and surface.is_editable:
        surface.vellus.new_hair_mask, surface.vellus.has_new_hair_mask = "", False
