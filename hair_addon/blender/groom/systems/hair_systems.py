# SPDX-License-Identifier: GPL-3.0-or-later
"""The hair systems of a mesh: hair with its guides, or guides without hair, edited as one.

A system is identified by its Curves datablock, of the hair or of guides without hair. Nothing is stored: the list and
the edited system are computed from the objects of a view layer and the active object.
"""

import re

import bpy
from bpy.types import Curves, Object, ViewLayer

from ...data.strands.curves import followers
from ...settings import computed_properties, properties
from ..selection import active_of_kind, make_active, object_of, painted_hair, surface_of
from . import mask_suggestions


def systems_of(surface: Object, view_layer: ViewLayer) -> list[Curves]:
    """Return the Curves of the hair systems on a mesh object that have objects in a view layer, oldest first."""
    if surface is None or not any(c.surface == surface for c in bpy.data.hair_curves):
        return []  # panels call this on every redraw, and a view layer may have thousands of objects
    return [c for c in all_systems(view_layer) if c.surface == surface]


def all_systems(view_layer: ViewLayer) -> list[Curves]:
    """Return the Curves of all hair systems that have objects in a view layer, oldest first."""
    curves = {o.data for o in view_layer.objects if o is not None and o.type == "CURVES"}
    hair = {c for c in curves if c.vellus.kind == "HAIR"}
    followed = {c.vellus.guide_curves for c in hair}
    lone_guides = {c for c in curves - followed if c.vellus.kind == "GUIDES"}
    return sorted(hair | lone_guides, key=lambda c: c.session_uid)


def edited_system(view_layer: ViewLayer) -> Curves | None:
    """Return the Curves of the edited system: of the active object, or the one that is painted or the newest on the
    active mesh; None if there is none."""
    active = view_layer.objects.active
    systems = systems_of(surface_of(active), view_layer)
    guides, hair = active_of_kind(active, "GUIDES"), active_of_kind(active, "HAIR")
    if hair is not None:
        return hair if hair in systems else None
    if guides is not None:
        followers = [c for c in systems if c.vellus.guide_curves == guides]
        return followers[-1] if followers else (guides if guides in systems else None)
    painted = None if active is None or active.type != "MESH" else painted_hair(active)
    if painted in systems:
        return painted
    with_hair = [c for c in systems if c.vellus.kind == "HAIR"]
    return (with_hair or systems or [None])[-1]


def guides_of_system(system: Curves) -> Curves | None:
    """Return the guide Curves of a system; None for hair without guides."""
    return system if system.vellus.kind == "GUIDES" else system.vellus.guide_curves


def parts_of_system(system: Curves) -> list[Curves]:
    """Return the Curves to delete with a system: its hair, and its guides unless other hair follows them."""
    guides = guides_of_system(system)
    others = [c for c in bpy.data.hair_curves if c != system and c.vellus.guide_curves == guides and c.users]
    return [system] if guides in {None, system} or others else [system, guides]


def edit(system: Curves, view_layer: ViewLayer) -> None:
    """Make the hair of a system active, or its guides in the same mode while guides are edited."""
    active = view_layer.objects.active
    chosen, mode = object_of(system, view_layer), "OBJECT"
    active_guides = active_of_kind(active, "GUIDES")
    if active_guides is not None and (active.mode != "OBJECT" or edited_system(view_layer) != active_guides):
        guides_object = object_of(guides_of_system(system), view_layer)
        if guides_object is not None:
            chosen, mode = guides_object, active.mode
    if chosen is None or chosen == active:
        return
    if active is not None and active.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")
    make_active(chosen, view_layer)
    if mode != "OBJECT" and chosen.visible_get(view_layer=view_layer):
        bpy.ops.object.mode_set(mode=mode)


def rename(curves_object: Object, name: str) -> None:
    """Rename an object and its Curves, and its guides unless an artist has named them."""
    if not name.strip() or curves_object.library is not None:
        return
    before = curves_object.name
    curves_object.name = name
    curves_object.data.name = curves_object.name
    name_guides(curves_object, before)


def name_guides(hair_object: Object, before: str = "") -> None:
    """Name guides after the hair that follows them, as *Fringe Guides*, unless an artist has named them.

    before: former name of the hair. Guides that other hair follows too keep their name.
    """
    guides = hair_object.data.vellus.guide_curves
    if guides is None or guides.library is not None or len(followers(guides)) > 1:
        return
    automatic = rf"Guides(\.\d+)?|{re.escape(before)} Guides(\.\d+)?"
    for shown in [guides, *(o for o in bpy.data.objects if o.data == guides)]:
        if re.fullmatch(automatic, shown.name):
            shown.name = f"{hair_object.name} Guides"


def _edited_index(view_layer):
    system = edited_system(view_layer)
    return next((index for index, curves in enumerate(bpy.data.hair_curves) if curves == system), -1)


def _edit_at(view_layer, index):
    if 0 <= index < len(bpy.data.hair_curves):
        edit(bpy.data.hair_curves[index], view_layer)


class VellusSystem(bpy.types.PropertyGroup):
    """Properties of an object in the list of hair systems"""

    __annotations__ = {
        "title": computed_properties.computed_text(
            "Name",
            "Name of the hair object and its curves",
            lambda group: group.id_data.name,
            lambda group, name: rename(group.id_data, name),
        ),
        "is_visible": computed_properties.computed_flag(
            "Show in Viewports",
            "Show this hair in viewports of this view layer. Renders are not affected",
            lambda group: not group.id_data.hide_get(),
            lambda group, is_visible: group.id_data.hide_set(not is_visible),
        ),
    }


class VellusNewHair(bpy.types.PropertyGroup):
    """Settings of the next hair system on a mesh object"""

    __annotations__ = {
        "mask": computed_properties.computed_text(
            "Guide Mask",
            "Vertex group that new hair grows in; length, thickness and gravity are fitted to it. Leave empty for the "
            "whole mesh",
            lambda group: mask_suggestions.mask_of(group.id_data),
            lambda group, name: _choose_mask(group.id_data, name),
        )
    }


def _choose_mask(surface, name):
    surface.vellus.new_hair_mask, surface.vellus.has_new_hair_mask = name, True


CLASSES = (VellusSystem, VellusNewHair)


def register() -> None:
    """Register the list's properties of objects, and its active row of view layers."""
    bpy.types.Object.vellus_new_hair = properties.group_of(VellusNewHair)
    bpy.types.Object.vellus_system = properties.group_of(VellusSystem)
    bpy.types.ViewLayer.vellus_system = computed_properties.computed_index(
        "Edited System", "The hair system to edit", _edited_index, _edit_at
    )


def unregister() -> None:
    """Remove both; nothing is stored in files."""
    del bpy.types.ViewLayer.vellus_system
    del bpy.types.Object.vellus_system
    del bpy.types.Object.vellus_new_hair
