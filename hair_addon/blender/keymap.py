# SPDX-License-Identifier: GPL-3.0-or-later
"""Clicks into a viewport that hair answers to, before Blender's own selection does."""

import bpy

# The keymaps that Blender selects by: of viewports, and of the tools that have a click of their own.
_KEYMAPS = (
    ("3D View", {}),
    ("3D View Tool: Tweak", {"tool": True}),
    ("3D View Tool: Select Box", {"tool": True}),
)

_OPERATOR = "vellus.pick_hair"


def register():
    """Listen to the button that selects; without a window there is none."""
    config = bpy.context.window_manager.keyconfigs.addon
    if config is None:
        return
    for name, details in _KEYMAPS:
        keymap = config.keymaps.new(name, space_type="VIEW_3D", region_type="WINDOW", **details)
        for is_toggled in (False, True):
            keymap.keymap_items.new(_OPERATOR, "LEFTMOUSE", "PRESS", shift=is_toggled)


def unregister():
    """Leave clicks to Blender."""
    config = bpy.context.window_manager.keyconfigs.addon
    if config is None:
        return
    for keymap in config.keymaps:
        for item in [item for item in keymap.keymap_items if item.idname == _OPERATOR]:
            keymap.keymap_items.remove(item)
