# SPDX-License-Identifier: GPL-3.0-or-later
"""The targets of operators, from the active object: its surface, the guides on it, the hair that follows them."""

from itertools import repeat

import bpy
from bpy.types import Context, Curves, Object, SpaceView3D, ViewLayer

from ..data.strands import curves
from ..data.strands.curves import followers
from ..data.usable_surfaces import is_deleted
from ..host.notices import name_of, text_of
from ..settings import map_items, style_items


def is_shown(hair: Curves) -> bool:
    """Whether an object uses hair Curves: Blender keeps the Curves of deleted objects until the file is saved."""
    return hair.users > hair.use_fake_user


def followers_shown(guides: Curves) -> list[Curves]:
    """Hair Curves that follow the guides and have an object."""
    return [hair for hair in followers(guides) if is_shown(hair)]


def has_object(guides: Curves) -> bool:
    """Whether anything except hair that follows them uses guide Curves."""
    return guides.users - guides.use_fake_user > len(followers(guides))


def active_of_kind(active: Object | None, kind: str) -> Curves | None:
    """Return the Curves of the active object if they are of a kind, GUIDES or HAIR; else None."""
    if active is not None and active.type == "CURVES" and active.data.vellus.kind == kind:
        return active.data
    return None


def surface_of(active: Object | None) -> Object | None:
    """Return the active mesh object, or the one that the active guides or hair grow on; None if there is none."""
    if active is None:
        return None
    if active.type == "MESH":
        return active
    return active.data.surface if active.type == "CURVES" else None


def guides_to_regenerate(active: Object | None) -> Curves | None:
    """Return the guides to replace when regenerating: the active ones, or those of the active hair; None on a mesh."""
    hair = active_of_kind(active, "HAIR")
    return active_of_kind(active, "GUIDES") if hair is None else hair.vellus.guide_curves


def guides_of(active: Object | None) -> Curves | None:
    """Return the active guides, the active hair's guides, or the newest guides on the active mesh; None if none."""
    if active is None or active.type != "MESH":
        return guides_to_regenerate(active)
    return _newest(curves_on(active, "GUIDES"))


def guides_named(name: str) -> Curves | None:
    """Return the guide Curves with a name, or of the object with that name; None if there are none."""
    found = bpy.data.hair_curves.get(name)
    if found is not None and found.vellus.kind == "GUIDES":
        return found
    return active_of_kind(bpy.data.objects.get(name), "GUIDES")


def hair_of(active: Object | None) -> Curves | None:
    """Return the active hair, the newest hair of the active guides, or the newest on the active mesh; None if none.

    On a mesh in a paint mode, the hair whose mask is painted.
    """
    if active is None:
        return None
    if active.type == "MESH":
        return painted_hair(active) or _newest(curves_on(active, "HAIR"))
    guides = active_of_kind(active, "GUIDES")
    return active_of_kind(active, "HAIR") if guides is None else _newest(followers_shown(guides))


def painted_hair(active: Object) -> Curves | None:
    """Return the hair whose mask is painted on a mesh object in a paint mode; None if there is none.

    Hair whose active style has the mask comes first, then hair with another such style, then hair whose map it is, then
    hair that it limits.
    """
    painted = _painted(active)
    if not any(painted):
        return None
    for masks_of in (_active_masks, _style_masks, _map_sources, _density_masks):
        masked = [hair for hair in hair_grown_on(active) if any(map(_are_alike, masks_of(hair), repeat(painted)))]
        if masked:
            return _newest(masked)
    return None


def _painted(active):
    """Return the names (group or attribute, image) that a paint mode paints; empty for none."""
    if active.mode == "TEXTURE_PAINT":
        settings = bpy.context.scene.tool_settings.image_paint
        return "", _name_of(settings.canvas if settings.mode == "IMAGE" else None)
    painted = {
        "WEIGHT_PAINT": active.vertex_groups.active,
        "VERTEX_PAINT": active.data.color_attributes.active_color,
    }
    return _name_of(painted.get(active.mode)), ""


def _name_of(owner):
    return "" if owner is None else text_of(owner, "name")


def _are_alike(mask, painted):
    """Whether a mask's group or image is the painted one."""
    return any(one and one == other for one, other in zip(mask, painted, strict=True))


def _active_masks(hair):
    item = style_items.active_of(hair.vellus)
    return [] if item is None else [style_items.masks_of(item)]


def _style_masks(hair):
    return [style_items.masks_of(item) for item in hair.vellus.styles]


def _map_sources(hair):
    named = [text_of(item, "source") for item in hair.vellus.maps if item.kind in {"GROUP", "ATTRIBUTE"}]
    return [*((name, "") for name in named), *(("", name_of(image)) for image in map_items.images_of(hair.vellus))]


def _density_masks(hair):
    guides = hair.vellus.guide_curves
    limited = [hair.vellus.hair] + ([] if guides is None else [guides.vellus.guides])
    return [(text_of(settings, "density_group"), text_of(settings, "density_image")) for settings in limited]


def curves_on(surface: Object, kind: str) -> list[Curves]:
    """Return all guide or hair Curves on a mesh object except deleted ones, guides with their hair."""
    found = [c for c in bpy.data.hair_curves if c.vellus.kind == kind and c.surface == surface]
    if kind == "HAIR":
        return [hair for hair in found if is_shown(hair)]
    return [guides for guides in found if has_object(guides) or followers_shown(guides)]


def hair_grown_on(surface: Object) -> list[Curves]:
    """Return all hair Curves that grow on a mesh object except deleted ones, even if only their guides are on it."""
    found = [c for c in bpy.data.hair_curves if c.vellus.kind == "HAIR" and curves.grown_on(c) == surface]
    return [hair for hair in found if is_shown(hair)]


def parts_of(active: Object | None) -> list[Curves]:
    """Return the Curves to delete together: the active guides and their hair, or the active hair and its guides if
    no other hair follows these, or all on the active mesh."""
    hair, guides = active_of_kind(active, "HAIR"), active_of_kind(active, "GUIDES")
    if hair is not None:
        its_guides = hair.vellus.guide_curves
        return [hair] if its_guides is None or followers_shown(its_guides) != [hair] else [hair, its_guides]
    if guides is not None:
        return [guides, *followers_shown(guides)]
    if active is None or active.type != "MESH":
        return []
    return curves_on(active, "GUIDES") + curves_on(active, "HAIR")


def drawn_with(active: Object | None) -> list[Curves]:
    """Return the hair whose drawing is toggled: the active hair, or all hair in the file."""
    hair = active_of_kind(active, "HAIR")
    return [c for c in bpy.data.hair_curves if c.vellus.kind == "HAIR"] if hair is None else [hair]


def mesh_to_attach_to(context: Context) -> Object | None:
    """Return the mesh object to attach active guides or hair to: the one selected with them, or their surface."""
    if not any(active_of_kind(context.object, kind) for kind in ("GUIDES", "HAIR")):
        return None
    selected = next((o for o in context.selected_objects if o.type == "MESH"), None)
    surface = context.object.data.surface
    return selected or (None if surface is None or is_deleted(surface) else surface)


def object_of(curves: Curves, view_layer: ViewLayer) -> Object | None:
    """Return the first object of Curves in a view layer; None if there is none."""
    return next((o for o in _there(view_layer) if o.data == curves), None)


def is_in(known: Object, view_layer: ViewLayer) -> bool:
    """Whether a view layer has an object; a library override and its linked object have the same name."""
    return known in _there(view_layer)


def make_active(chosen: Object | None, view_layer: ViewLayer) -> None:
    """Select only this object and make it active; without effect if the view layer does not have it."""
    there = _there(view_layer)
    if chosen not in there:
        return
    for other in there:
        other.select_set(other == chosen)
    view_layer.objects.active = chosen


def reveal(hidden: Object, view_layer: ViewLayer, viewport: SpaceView3D | None) -> None:
    """Show an object in its view layer, with its collections, and in the local view of a 3-D viewport (None: no view).

    Objects hidden by a library or a driver stay hidden.
    """
    if not hidden.visible_get(view_layer=view_layer):
        if hidden.library is None:
            hidden.hide_viewport = False
        hidden.hide_set(False, view_layer=view_layer)
        for shown in _path_to(hidden, view_layer.layer_collection):
            shown.hide_viewport = False
            if shown.collection.library is None:
                shown.collection.hide_viewport = False
    if viewport is not None and viewport.local_view is not None:
        hidden.local_view_set(viewport, True)


def _path_to(contained, layer_collection):
    """Return the path of layer collections from one down to the first that contains an object; empty if none does."""
    if layer_collection.exclude:
        return []
    if contained in {*layer_collection.collection.objects}:
        return [layer_collection]
    paths = (_path_to(contained, child) for child in layer_collection.children)
    return next(([layer_collection, *path] for path in paths if path), [])


def _there(view_layer):
    """Return the objects of a view layer; Blender lists objects removed by a script as None until the next update."""
    return [o for o in view_layer.objects if o is not None]


def _newest(candidates):
    return max(candidates, key=lambda curves: curves.session_uid, default=None)
