# SPDX-License-Identifier: GPL-3.0-or-later
"""Keymap: clicks on hair in viewports, before Blender's own selection, and the shortcut of the pie menu."""

import bpy

# Blender's keymaps for selection: of viewports, and of tools with their own click.
_CLICKED = (
    ("3D View", {}),
    ("3D View Tool: Tweak", {"tool": True}),
    ("3D View Tool: Select Box", {"tool": True}),
)
_MODES = ("Object Mode", "Sculpt Curves", "Curves")  # of the pie menu

_CLICK, _PIE = "vellus.pick_hair", "wm.call_menu_pie"
PIE = "VELLUS_MT_hair_pie"


def register():
    """Register the selection click and the shortcut; without a window there is no keymap."""
    config = bpy.context.window_manager.keyconfigs.addon
    if config is None:
        return
    for name, details in _CLICKED:
        keymap = config.keymaps.new(name, space_type="VIEW_3D", region_type="WINDOW", **details)
        for is_toggled in (False, True):
            keymap.keymap_items.new(_CLICK, "LEFTMOUSE", "PRESS", shift=is_toggled)
    for name in _MODES:
        item = config.keymaps.new(name).keymap_items.new(_PIE, "H", "PRESS", shift=True, alt=True)
        item.properties.name = PIE


def unregister():
    """Unregister the selection click and the shortcut."""
    config = bpy.context.window_manager.keyconfigs.addon
    if config is None:
        return
    for keymap in config.keymaps:
        for item in [item for item in keymap.keymap_items if _is_ours(item)]:
            keymap.keymap_items.remove(item)


def _is_ours(item):
    return item.idname == _CLICK or (item.idname == _PIE and item.properties.name == PIE)
