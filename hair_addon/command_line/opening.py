# SPDX-License-Identifier: GPL-3.0-or-later
"""Opening the input file of a command, with warnings about scripts that were not run."""

from ..core import lazy
from . import import_mesh

blender = lazy.Package("..blender", __package__)


def open_file(given, console, has_curves=False):
    """Open `given.input`; returns (3, 3), Blender's axes → the file's. Raises `HairError`.

    has_curves: whether the caller will read curves of the file.
    """
    blender.require_registered()
    blender.io.mesh_files.require_readable(given.input)
    lacks_axis = blender.io.mesh_files.lacks_up_axis(given.input)
    up = (lacks_axis and getattr(given, "up", None)) or "Z"
    if blender.io.mesh_files.may_crash_blender(given.input):
        return import_mesh.open_apart(given.input, up, console, has_curves)
    file_axes = blender.io.mesh_files.open_file(given.input, up=up, runs_scripts=given.enable_scripts)
    blocked = blender.io.mesh_files.blocked_scripts()
    if blocked:
        console.warn(f"{given.input} has scripts or drivers that were not run ({blocked}): --enable-scripts runs them.")
    return file_axes
