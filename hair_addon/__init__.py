# SPDX-License-Identifier: GPL-3.0-or-later
"""Vellus: hair for Blender. `hair_addon.core` is the mathematics, `hair_addon.blender` the Blender integration."""


def register():
    """Register the add-on."""
    from . import blender
    from .blender.host import cli_command

    blender.register()
    cli_command.register(_command)


def unregister():
    """Unregister the add-on; existing hair stays in the file."""
    from . import blender
    from .blender.host import cli_command

    cli_command.unregister()
    blender.unregister()


def _command(arguments):
    """blender --command vellus …; returns the exit status."""
    from . import command_line

    return command_line.main(arguments, "blender --command vellus")
