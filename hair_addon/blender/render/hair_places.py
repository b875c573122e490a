# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair visible in a viewport: objects of its view layer, and instances by collections and geometry nodes."""

from dataclasses import dataclass

import bpy
import numpy as np

from ..data import scene
from ..data.pictures.rendered_instances import is_rendered


@dataclass(frozen=True)
class HairPlace:
    """A place where hair is drawn.

    hair_object: the original object with hair Curves; to_world: (4, 4) float64; owner: session_uid of the object to
    select, which is the object itself or its instancer; is_selected: whether that object is selected.
    """

    hair_object: bpy.types.Object
    to_world: np.ndarray
    owner: int
    is_selected: bool


@dataclass(frozen=True)
class _Instance:
    """A reference to an instance by session UIDs, as its objects may be removed."""

    hair_object: int
    to_world: np.ndarray
    owner: int


def hair_places(view_layer, viewport, instances):
    """Return [`HairPlace`] of a view layer's visible hair and of instances from `read_instances`.

    viewport: the 3D viewport whose visibility settings apply, None for those of renders.
    """
    places = [
        HairPlace(o, np.array(o.matrix_world, np.float64), o.session_uid, o.select_get(view_layer=view_layer))
        for o in scene.curves_objects(view_layer, "HAIR", viewport)
        if viewport is not None or not o.hide_render
    ]
    if not instances:
        return places
    objects = {o.session_uid: o for o in bpy.data.objects}
    for instance in instances:
        hair_object, owner = objects.get(instance.hair_object), objects.get(instance.owner)
        if hair_object is not None and owner is not None:
            is_selected = owner.select_get(view_layer=view_layer)
            places.append(HairPlace(hair_object, instance.to_world, instance.owner, is_selected))
    return places


def read_instances(depsgraph, viewport):
    """Every instance of hair that a viewport shows; viewport: as for `hair_places`."""
    return tuple(_instances(depsgraph, viewport))


def _instances(depsgraph, viewport):
    # Iterating over many instances is slow, so it is skipped in files without hair.
    has_hair = any(curves.vellus.kind == "HAIR" for curves in bpy.data.hair_curves)
    if not has_hair or not (viewport is None or viewport.show_object_viewport_curves):
        return
    for instance in depsgraph.object_instances:
        if not instance.is_instance or instance.object.type != "CURVES" or not instance.show_self:
            continue
        hair_object, owner = instance.object.original, instance.parent.original
        if hair_object.data.vellus.kind != "HAIR":
            continue
        if not (is_rendered(instance) if viewport is None else owner.visible_in_viewport_get(viewport)):
            continue
        matrix = np.array(instance.matrix_world, np.float64)
        yield _Instance(hair_object.session_uid, matrix, owner.session_uid)
