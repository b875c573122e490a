# SPDX-License-Identifier: GPL-3.0-or-later
"""Vellus: hair for Blender. `hair_addon.core` is the mathematics, `hair_addon.blender` everything Blender."""


def register():
    """Make the add-on known to Blender."""
    from . import blender

    blender.register()


def unregister():
    """Take the add-on out of Blender; hair that was made stays in the file."""
    from . import blender

    blender.unregister()
