# SPDX-License-Identifier: GPL-3.0-or-later
"""Keymap of clicks on hair in viewports, before Blender's own selection."""

import bpy

# Blender's keymaps for selection: of viewports, and of tools with their own click.
_KEYMAPS = (
    ("3D View", {}),
    ("3D View Tool: Tweak", {"tool": True}),
    ("3D View Tool: Select Box", {"tool": True}),
)

_OPERATOR = "vellus.pick_hair"


def register():
    """Register the selection click; without a window there is no keymap."""
    config = bpy.context.window_manager.keyconfigs.addon
    if config is None:
        return
    for name, details in _KEYMAPS:
        keymap = config.keymaps.new(name, space_type="VIEW_3D", region_type="WINDOW", **details)
        for is_toggled in (False, True):
            keymap.keymap_items.new(_OPERATOR, "LEFTMOUSE", "PRESS", shift=is_toggled)


def unregister():
    """Unregister the selection click."""
    config = bpy.context.window_manager.keyconfigs.addon
    if config is None:
        return
    for keymap in config.keymaps:
        for item in [item for item in keymap.keymap_items if item.idname == _OPERATOR]:
            keymap.keymap_items.remove(item)
