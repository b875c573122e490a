# SPDX-License-Identifier: GPL-3.0-or-later
"""Everything Blender: classes in the order they need each other."""

import bpy

from . import handlers, operators, panels, preferences, properties, viewport

CLASSES = (
    preferences.VellusPreferences,
    *properties.CLASSES,
    *operators.CLASSES,
    *panels.CLASSES,
)


def register():
    """Register classes, then listen and draw."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    properties.register()
    handlers.register()
    viewport.register()


def unregister():
    """Undo `register` in reverse."""
    viewport.unregister()
    handlers.unregister()
    properties.unregister()
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
