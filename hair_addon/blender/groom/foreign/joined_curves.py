# SPDX-License-Identifier: GPL-3.0-or-later
"""Joining of several objects with curves into one object, used as one hair system."""

from collections.abc import Callable, Sequence
from typing import Any

import bpy
import numpy as np
from bpy.types import Object

from ....core.long_work import Work
from ...data import whole_changes
from ...data.strands import attributes
from ...host.datablocks import Remembered
from ...host.notices import name_of
from . import foreign_curves, hand_made_guides


@whole_changes.whole
def using(
    objects: Sequence[Object],
    surface_object: Object,
    use: Callable[[Object, bool], Work[Any]],
    applies_modifiers: bool,
) -> Work[Any]:
    """Join the curves of objects into one with the name and coordinates of the first, and use it; removes the others.

    use: a function of (object, whether to apply its modifiers) that returns the work. The objects do not change until
    it is done, nor if it is canceled or raises `HairError`.
    """
    if len(objects) == 1:
        return (yield from use(objects[0], applies_modifiers))
    for one in objects:
        hand_made_guides.require_usable(one, surface_object)
    name, used, joined = name_of(objects[0]), [Remembered(one) for one in objects], _joined(objects, applies_modifiers)
    copy = Remembered(joined)
    made = yield from use(joined, True)
    for one in used:
        whole_changes.keep_copy(one.find())
        _remove(one.find())
    _rename(copy.find(), name)
    return made


def _rename(curves_object, name):
    curves_object.name = curves_object.data.name = name


def _joined(objects, applies_modifiers):
    """Add an object with the curves of all objects and the transform of the first; return it."""
    copies, before = [], {data.session_uid for data in _all_data()}
    for one in objects:
        copies.append(_copy(one))
        foreign_curves.take(copies[-1], applies_modifiers)
    _unite_radii(copies)
    first = copies[0]
    with bpy.context.temp_override(
        active_object=first, object=first, selected_objects=copies, selected_editable_objects=copies
    ):
        bpy.ops.object.join()
    # Blender keeps the data of converted and joined objects, with wrong user counts.
    used = {one.data for one in bpy.data.objects}
    bpy.data.batch_remove([data for data in _all_data() if data.session_uid not in before and data not in used])
    bpy.context.view_layer.update()
    return first


def _all_data():
    return [*bpy.data.curves, *bpy.data.hair_curves]


def _copy(curves_object):
    copy = curves_object.copy()
    copy.data = curves_object.data.copy()
    for collection in curves_object.users_collection:
        collection.objects.link(copy)
    bpy.context.view_layer.update()
    return copy


def _unite_radii(copies):
    """Give all curves radii if some have them, scaled so that joining keeps widths in the world.

    Blender joins radii unscaled, and uses 1 m for curves without radii.
    """
    found = [attributes.read(copy.data, "radius", "FLOAT", "POINT") for copy in copies]
    if all(radii is None for radii in found):
        return
    sizes = [abs(copy.matrix_world.to_3x3().determinant()) ** (1.0 / 3.0) for copy in copies]
    for copy, radii, size in zip(copies, found, sizes, strict=True):
        if radii is None:
            radii = np.full(len(copy.data.points), attributes.RADIUS, np.float32)
        attributes.write(copy.data, "radius", "FLOAT", "POINT", radii * np.float32(size / (sizes[0] or 1.0)))


def _remove(curves_object):
    data = curves_object.data
    bpy.data.objects.remove(curves_object)
    if data.users == 0:
        bpy.data.batch_remove([data])
