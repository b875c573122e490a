# SPDX-License-Identifier: GPL-3.0-or-later
"""Registration of all Blender classes, in order of dependence."""

import atexit
import sys

import bpy

from ..core.errors import HairError
from . import manual
from .groom.systems import hair_systems
from .host import background_process, running
from .live import first_setup, handlers, invalidation
from .render.frames import engine
from .render.viewport import viewport
from .settings import preferences, properties, strokes, translations
from .ui import asset_shelf, engine_panels, keymap, look_previews, menus, operators, panels, picture_menus, tools

CLASSES = (
    preferences.VellusPreferences,
    *properties.CLASSES,
    *hair_systems.CLASSES,
    engine.VellusRenderEngine,
    *strokes.CLASSES,
    *operators.CLASSES,
    *picture_menus.CLASSES,
    *panels.LISTS,
    *panels.CLASSES,
    *menus.CLASSES,
    *asset_shelf.CLASSES,
)

_PATIENCE = 0.5  # [s] between checks whether a render has ended


def require_registered():
    """Register the add-on in a checkout. Raises `HairError` for a disabled extension."""
    if hasattr(bpy.types.Curves, "vellus"):
        return
    if __package__.startswith("bl_ext."):  # Blender would register it twice when it is enabled
        raise HairError("The add-on is disabled: enable Vellus in Blender's preferences.")
    register()


def register():
    """Register classes, then handlers and drawing."""
    if bpy.app.timers.is_registered(_unregister_after_render):  # enabled again during the wait
        bpy.app.timers.unregister(_unregister_after_render)
        bpy.app.timers.register(_show_usual_status_bars)  # bpy.data is restricted while an add-on is enabled
        return
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    translations.register()
    properties.register()
    hair_systems.register()
    picture_menus.register()
    menus.register()
    asset_shelf.register()
    engine_panels.register()
    keymap.register()
    tools.register()
    manual.register()
    handlers.register()
    viewport.register()
    first_setup.register()
    # Blender's own exit handler runs too late.
    atexit.unregister(invalidation.end)
    atexit.register(invalidation.end)


def unregister():
    """Undo `register` in reverse: at once, or when a render in a window has ended.

    Otherwise there would be a deadlock: Blender waits for the render thread, which waits for Python's lock.
    """
    if not running.is_rendering():
        _unregister()
    elif not bpy.app.timers.is_registered(_unregister_after_render):
        bpy.app.timers.register(_unregister_after_render, first_interval=_PATIENCE, persistent=True)
        sentence = translations.interface_text("Blender renders: Vellus is disabled when the render has ended.")
        print(f"Vellus: {sentence}", file=sys.stderr)
        _show_in_status_bars(sentence)


def _unregister_after_render():
    """Unregister once no render runs; a function for `bpy.app.timers`."""
    if running.is_rendering():
        return _PATIENCE
    _show_in_status_bars(None)
    _unregister()
    return None


def _show_usual_status_bars():
    """Remove our text from status bars; a function for `bpy.app.timers`."""
    _show_in_status_bars(None)


def _show_in_status_bars(text):
    """Show a text in the status bars of all windows; None restores Blender's own."""
    for workspace in bpy.data.workspaces if running.has_window() else ():
        workspace.status_text_set(text)


def _unregister():
    running.end(bpy.context)
    background_process.end()
    first_setup.unregister()
    viewport.unregister()
    handlers.unregister()
    invalidation.clear()
    manual.unregister()
    tools.unregister()
    keymap.unregister()
    engine_panels.unregister()
    asset_shelf.unregister()
    menus.unregister()
    picture_menus.unregister()
    hair_systems.unregister()
    properties.unregister()
    look_previews.unregister()
    translations.unregister()
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
