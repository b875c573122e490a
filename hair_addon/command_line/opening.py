# SPDX-License-Identifier: GPL-3.0-or-later
"""Opening the file that a verb works on, and telling what was kept from running."""


def open_file(given, console):
    """Open `given.input`; returns (3, 3), Blender's axes → the file's. Raises `HairError`."""
    from ..blender import mesh_files

    file_axes = mesh_files.open_file(given.input, up=getattr(given, "up", "Z"), runs_scripts=given.enable_scripts)
    kept = mesh_files.scripts_kept_from_running()
    if kept:
        console.warn(f"{given.input} has scripts or drivers that were not run ({kept}): --enable-scripts runs them.")
    return file_axes
