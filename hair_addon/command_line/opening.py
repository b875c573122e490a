# SPDX-License-Identifier: GPL-3.0-or-later
"""Opening the input file of a command, with warnings about scripts that were not run."""

from ..core import lazy

blender = lazy.Package("..blender", __package__)


def open_file(given, console):
    """Open `given.input`; returns (3, 3), Blender's axes → the file's. Raises `HairError`."""
    blender.require_registered()
    file_axes = blender.io.mesh_files.open_file(
        given.input, up=getattr(given, "up", None) or "Z", runs_scripts=given.enable_scripts
    )
    kept = blender.io.mesh_files.scripts_kept_from_running()
    if kept:
        console.warn(f"{given.input} has scripts or drivers that were not run ({kept}): --enable-scripts runs them.")
    return file_axes
