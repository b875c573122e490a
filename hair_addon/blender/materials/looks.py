# SPDX-License-Identifier: GPL-3.0-or-later
"""Material and display of hair, from its settings."""

from dataclasses import replace

from ...core.errors import HairError
from ..data.strands import curves, curves_objects
from ..settings import setting_properties
from . import materials


def evaluate_shading(target, is_soon=False):
    """Update a hair's material from its settings, and its display type from *Shaded in Viewport*.

    is_soon: `strand_maps.write_pending` stores looks from maps later.
    """
    target.vellus.is_shading_stale = False
    curves_objects.draw_natively(target, not target.vellus.is_drawn)
    try:
        errors = materials.write_hair_material(target, is_soon)
        target.vellus.shading_status = str(errors[0]) if errors else ""
    except HairError as error:
        target.vellus.shading_status = str(error)


def are_guides_shown(guides):
    """Whether viewports show guides that are not selected: if set, or while they have no hair."""
    return guides.vellus.show_guides or not any(hair.users for hair in curves.followers(guides))


def evaluate_guides(guides):
    """Let Blender draw guides that are shown, so that they can be selected by clicking, and hide others."""
    guides.vellus.is_shading_stale = False
    curves_objects.draw_natively(guides, are_guides_shown(guides))


def follow_guides(view_layer):
    """Update the display of a view layer's guides, depending on their hair."""
    drawn = {True: "TEXTURED", False: "BOUNDS"}
    for shown in view_layer.objects:
        if shown is not None and shown.type == "CURVES" and shown.data.vellus.kind == "GUIDES":
            # Other display types were set by the user.
            if shown.display_type == drawn[not are_guides_shown(shown.data)]:
                evaluate_guides(shown.data)


def apply_look(target, look):
    """Apply an `Appearance` to hair, except its mode, which is not part of a look. Raises `HairError`."""
    curves.require_editable(target)
    group = target.vellus.appearance
    setting_properties.assign(group, replace(look, mode=group.mode))
    evaluate_shading(target)


def show_shaded(hair, is_drawn):
    """Let Vellus or Blender draw hair datablocks in viewports. Raises `HairError`."""
    for target in hair:
        curves.require_editable(target)
    for target in hair:
        target.vellus.is_drawn = is_drawn
        evaluate_shading(target)
