# SPDX-License-Identifier: GPL-3.0-or-later
"""The density of strands, painted on the surface with Blender's brushes."""

import numpy as np
from bpy.types import Context, Curves

from ....core.errors import HairError
from ...data import scene, vertex_groups
from ...data.strands import curves
from ...host.notices import name_of, text_of
from . import painted_masks

_GROUP = "Density"


def paint(hair: Curves, context: Context) -> None:
    """Enter the paint mode of the strand mask of hair, or of its density image.

    Without a mask and an image, a new vertex group begins as the mask of the guides, or with full weights. Raises
    `HairError` before anything changes.
    """
    curves.require_editable(hair)
    surface, settings = curves.grown_on(hair), hair.vellus.hair
    painted_masks.require_paintable(surface, context)
    if curves.is_hand_made(hair):
        raise HairError('"{name}" is kept unchanged: regenerate the strands first.', name=name_of(hair))
    mask, image = text_of(settings, "density_group"), text_of(settings, "density_image")
    if not mask and image:
        painted_masks.set_canvas(painted_masks.canvas_of(surface, image), context)
        painted_masks.enter(surface, "TEXTURE_PAINT", context)
        return
    if mask and mask not in surface.vertex_groups:
        surface.data.color_attributes.active_color = _color_attribute(surface, mask)
        painted_masks.enter(surface, "VERTEX_PAINT", context)
        return
    inherited = "" if mask else _mask_of_guides(hair)
    group = surface.vertex_groups.get(mask) or _new_group(surface, inherited)
    surface.vertex_groups.active = group
    painted_masks.enter(surface, "WEIGHT_PAINT", context)
    if not mask:
        if hair.vellus.guide_curves is not None:
            settings.density_image = text_of(hair.vellus.guide_curves.vellus.guides, "density_image")
        settings.density_group = name_of(group)


def _color_attribute(surface, mask):
    """Return the color attribute of a mask. Raises `HairError`."""
    found = surface.data.color_attributes.get(mask)
    if found is None:
        sentence = 'The mask "{mask}" is not a vertex group or color attribute: clear it to paint a new one.'
        raise HairError(sentence, mask=mask)
    return found


def _mask_of_guides(hair):
    """Return the vertex group that masks the guides of hair, or "". Raises `HairError` for an attribute."""
    guides = hair.vellus.guide_curves
    mask = "" if guides is None else text_of(guides.vellus.guides, "density_group")
    if mask and mask not in curves.grown_on(hair).vertex_groups:
        sentence = 'The mask "{mask}" is not a vertex group or color attribute: clear it to paint a new one.'
        raise HairError(sentence, mask=mask)
    return mask


def _new_group(surface, inherited):
    weights = np.ones(len(surface.data.vertices), np.float32)
    if inherited:
        weights = scene.weights_in_group(surface.data, surface.vertex_groups[inherited].index)
    group = surface.vertex_groups.new(name=_GROUP)
    vertex_groups.paint(group, weights, leaves_out_zero=False)
    return group
