# SPDX-License-Identifier: GPL-3.0-or-later
"""blender --command vellus: the command registered with the add-on."""

import sys

import bpy

_command = None


def register(run):
    """Register the command: Blender calls run(arguments), which returns the exit status."""
    global _command
    _command = bpy.utils.register_cli_command("vellus", run)


def unregister():
    """Remove the command."""
    global _command
    bpy.utils.unregister_cli_command(_command)
    _command = None


def words():
    """Return the arguments that start another process like this one."""
    if bpy.app.module:
        return [sys.executable, "-m", "hair_addon"]
    return [bpy.app.binary_path, "--command", "vellus"]
