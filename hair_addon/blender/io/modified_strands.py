# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands with the artist's modifiers applied, so that files and meshes match renders."""

import bpy
import numpy as np

from ...core.errors import HairError
from ..data import scene
from ..data.strands import attributes, curves, delivered_hair, follow_nodes
from ..groom import selection
from ..host.notices import name_of


def curves_of(datablock):
    """Return the evaluated Curves of hair with modifiers, valid until the next evaluation; without any, the datablock.

    None if the object is hidden, if viewports and renders use different modifiers, or if modifiers change the points,
    which stored attributes would not fit.
    """
    shown = selection.object_of(datablock, bpy.context.view_layer)
    if not _modifiers(shown):
        return datablock
    others = [m for m in shown.modifiers if m != follow_nodes.modifier_of(shown)]
    if not shown.visible_get() or any(m.show_viewport != m.show_render for m in others):
        return None
    evaluated = shown.evaluated_get(scene.present_depsgraph()).data
    if not isinstance(evaluated, bpy.types.Curves):
        return None
    is_same = np.array_equal(curves.point_counts(evaluated), curves.point_counts(datablock))
    is_same = is_same and np.array_equal(attributes.are_smooth(evaluated), attributes.are_smooth(datablock))
    return evaluated if is_same else None


def notes_of(datablock):
    """Yield a note if the modifiers of hair Curves are ignored."""
    if curves_of(datablock) is None:
        names = ", ".join(_modifiers(selection.object_of(datablock, bpy.context.view_layer)))
        sentence = 'Modifiers of "{name}" are left out, as they change its number of points or are hidden: {names}.'
        yield HairError(sentence, name=name_of(datablock), names=names)


def _modifiers(shown):
    """Names of the modifiers added by the artist to an object, which may be None."""
    if shown is None:
        return []
    delivered = delivered_hair.modifier_of(shown)
    names = follow_nodes.modifiers_of_artist(shown)
    return [name for name in names if delivered is None or name != name_of(delivered)]
