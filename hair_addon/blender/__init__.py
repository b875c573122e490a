# SPDX-License-Identifier: GPL-3.0-or-later
"""Everything Blender: classes in the order they need each other."""

import atexit

import bpy

from . import (
    engine,
    engine_panels,
    handlers,
    keymap,
    menus,
    operators,
    panels,
    preferences,
    properties,
    rendered_view,
    running,
    shaders,
    translations,
    viewport,
)

CLASSES = (
    preferences.VellusPreferences,
    *properties.CLASSES,
    engine.VellusRenderEngine,
    *operators.CLASSES,
    *panels.CLASSES,
    *menus.CLASSES,
)


def register():
    """Register classes, then listen and draw."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    translations.register()
    properties.register()
    menus.register()
    engine_panels.register()
    keymap.register()
    handlers.register()
    viewport.register()
    atexit.unregister(_release)
    atexit.register(_release)


def _release():
    """Python ends: what is on the GPU is freed while there is one. Blender's own handler of its exit comes too late."""
    rendered_view.clear()
    viewport.release()
    shaders.forget()


def unregister():
    """Undo `register` in reverse."""
    running.end(bpy.context)
    rendered_view.clear()
    viewport.unregister()
    handlers.unregister()
    keymap.unregister()
    engine_panels.unregister()
    menus.unregister()
    properties.unregister()
    translations.unregister()
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
