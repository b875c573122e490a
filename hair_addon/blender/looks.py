# SPDX-License-Identifier: GPL-3.0-or-later
"""How hair looks, and who draws it: settings → material, and whether Blender's own drawing shows."""

from dataclasses import replace

from ..core.errors import HairError
from . import curves, materials, properties


def evaluate_shading(target):
    """Bring a hair's material in line with its settings, and what Blender draws with who draws it."""
    target.vellus.is_shading_stale = False
    curves.draw_natively(target, not target.vellus.is_drawn)
    try:
        materials.write_hair_material(target)
        target.vellus.shading_status = ""
    except HairError as error:
        target.vellus.shading_status = str(error)


def apply_look(target, look):
    """Give hair an `Appearance`, but for its mode: how to draw is no part of a look. Raises `HairError`."""
    curves.require_editable(target)
    group = target.vellus.appearance
    properties.assign(group, replace(look, mode=group.mode))
    evaluate_shading(target)


def show_shaded(hair, is_drawn):
    """Let Vellus draw hair datablocks in viewports, or Blender. Raises `HairError`."""
    for target in hair:
        curves.require_editable(target)
    for target in hair:
        target.vellus.is_drawn = is_drawn
        evaluate_shading(target)


def follow_selection(view_layer):
    """Show which hair is selected of what Blender does not draw."""
    for shown in view_layer.objects:
        state = shown.data.vellus if shown is not None and shown.type == "CURVES" else None
        if state is not None and state.kind == "HAIR" and state.is_drawn:
            curves.show_selection(shown)
