# SPDX-License-Identifier: GPL-3.0-or-later
"""Masks of styles, painted on the surface with Blender's brushes or made from a selection of guides."""

import bpy
import numpy as np
from bpy.types import Context, Curves, Image, Object, PropertyGroup

from ....core.errors import HairError, cause_of
from ...data.strands import curves, guide_curves
from ...data.strands.attributes import read, write
from ...host.notices import name_of
from ...settings import style_items
from .. import bindings, selection, writing

# Blender's paint modes by `Object.mode`.
PAINT_MODES = ("WEIGHT_PAINT", "VERTEX_PAINT", "TEXTURE_PAINT")


def is_painting(active: Object | None) -> bool:
    """Whether an object is a surface with hair in one of Blender's paint modes."""
    return active is not None and active.mode in PAINT_MODES and bool(selection.hair_grown_on(active))


def paint(hair: Curves, item: PropertyGroup, context: Context) -> None:
    """Enter the paint mode of a style's mask on the surface of hair; creates a vertex group for a style without mask.

    item: the style's properties. Raises `HairError` before anything changes.
    """
    curves.require_editable(hair)
    surface, group = curves.grown_on(hair), style_items.group_of(item)
    require_paintable(surface, context)
    mask, attribute = group.mask, surface.data.color_attributes.get(group.mask)
    if not mask and group.mask_image:
        mode = "TEXTURE_PAINT"
        set_canvas(canvas_of(surface, group.mask_image), context)
    elif mask and attribute is not None and mask not in surface.vertex_groups:
        mode = "VERTEX_PAINT"
        surface.data.color_attributes.active_color = attribute
    else:
        mode = "WEIGHT_PAINT"
        _require_group(hair, mask)
        name = mask or _new_name(hair, item)
        painted = surface.vertex_groups.get(name) or surface.vertex_groups.new(name=name)
        surface.vertex_groups.active = painted
        mask = painted.name
    enter(surface, mode, context)
    if group.mask != mask:
        group.mask = mask  # last: nothing can fail after it


def set_canvas(image: Image, context: Context) -> None:
    """Let Texture Paint mode paint an image."""
    paint_settings = context.tool_settings.image_paint
    paint_settings.mode, paint_settings.canvas = "IMAGE", image


def enter(surface: Object, mode: str, context: Context) -> None:
    """Enter a paint mode on the surface of hair, which becomes visible and active. Raises `HairError`."""
    selection.reveal(surface, context.view_layer, _viewport(context))
    selection.make_active(surface, context.view_layer)
    try:
        bpy.ops.object.mode_set(mode=mode)
    except RuntimeError as error:  # hidden by a library or a driver
        raise HairError('"{name}" cannot be painted: {cause}.', name=name_of(surface), cause=cause_of(error)) from error


def stop(surface: Object, context: Context) -> None:
    """Leave the paint mode of a surface, and select the hair whose mask was painted."""
    painted = selection.painted_hair(surface)
    bpy.ops.object.mode_set(mode="OBJECT")
    present = reversed(selection.hair_grown_on(surface))
    wanted = present if painted is None else (painted, *present)
    shown = (selection.object_of(hair, context.view_layer) for hair in wanted)
    hair_object = next((o for o in shown if o is not None and o.visible_get(view_layer=context.view_layer)), None)
    if hair_object is not None:
        selection.make_active(hair_object, context.view_layer)


def from_selection(hair: Curves, item: PropertyGroup) -> int:
    """Store the selection of a hair's guides as an attribute, the mask of a style; returns the number selected.

    item: the style's properties. Raises `HairError`.
    """
    guides = hair.vellus.guide_curves
    for datablock in (hair, guides):
        curves.require_editable(datablock)
    weights = guide_curves.selection(guides, curves.curve_offsets(guides))
    if weights is None:
        raise HairError("Select guides in Sculpt Mode first: Blender stores no selection where all are selected.")
    group = style_items.group_of(item)
    name = group.mask if _is_guide_mask(hair, group.mask) else _new_name(hair, item)
    write(guides, name, "FLOAT", "CURVE", weights)
    followers, count = curves.followers(guides), int(np.count_nonzero(weights))
    for follower in followers:
        bound = bindings.of(follower)
        if bound is not None and not bound.is_written and follower.library is None:
            writing.write_hair(follower)  # bound hair may have newer weights than its datablock
    group.mask = name
    for follower in followers:
        follower.vellus.is_stale = True
        follower.update_tag()
    return count


def require_paintable(surface: Object | None, context: Context) -> None:
    """Raise `HairError` unless a surface can be painted in the view layer of a context."""
    if surface is None or surface.type != "MESH":
        raise HairError("The surface is missing: pick a mesh.")
    curves.require_overridable(surface)
    curves.require_editable(surface.data)
    if surface not in [*context.view_layer.objects]:
        raise HairError('"{name}" is not in this view layer: include one of its collections.', name=name_of(surface))


def _require_group(hair, mask):
    """Raise `HairError` if a mask is an attribute that cannot be painted."""
    if mask and mask not in curves.grown_on(hair).vertex_groups and _has_attribute(hair, mask):
        sentence = 'The mask "{mask}" is not a vertex group or color attribute: clear it to paint a new one.'
        raise HairError(sentence, mask=mask)


def _has_attribute(hair, name):
    guides = hair.vellus.guide_curves
    return name in curves.grown_on(hair).data.attributes or (guides is not None and name in guides.attributes)


def canvas_of(surface: Object, name: str) -> Image:
    """Return the image of a name to paint on a surface. Raises `HairError` without an image or a UV map."""
    image = bpy.data.images.get(name)
    if image is None:
        raise HairError('There is no image "{name}": pick another image, or clear the field.', name=name)
    curves.require_editable(image)
    if not surface.data.uv_layers:
        sentence = '"{name}" has no UV map for the density image: create one, or clear the image.'
        raise HairError(sentence, name=name_of(surface))
    return image


def _new_name(hair, item):
    """Return a name after the style that no vertex group or attribute of surface and guides has."""
    surface = curves.grown_on(hair)
    owners = [] if surface is None else [surface.data.attributes, surface.vertex_groups]
    owners += [] if hair.vellus.guide_curves is None else [hair.vellus.guide_curves.attributes]
    return style_items.unique_name(f"{item.name} Mask", {entry.name for owner in owners for entry in owner})


def _is_guide_mask(hair, mask):
    """Whether a mask is an attribute written by `from_selection`, and no other data has its name."""
    surface = curves.grown_on(hair)
    if not mask or (surface is not None and (mask in surface.vertex_groups or mask in surface.data.attributes)):
        return False
    return read(hair.vellus.guide_curves, mask, "FLOAT", "CURVE") is not None


def _viewport(context):
    return context.space_data if context.area is not None and context.area.type == "VIEW_3D" else None
