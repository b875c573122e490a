# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that are made once and kept: in the user's folder of the extension, or as long as Blender runs."""

import tempfile
from pathlib import Path

import bpy

from ...settings import preferences

_MOST_KEPT = 64  # files


def folder(name):
    """Return the folder of files of a kind."""
    if preferences.is_extension():
        found = bpy.utils.extension_path_user(preferences.ADDON_MODULE, path=name, create=True)
        if found:  # empty if Blender could not create it, which it reports on the console
            return Path(found)
    found = Path(bpy.app.tempdir or tempfile.gettempdir()) / f"vellus_{name}"
    found.mkdir(exist_ok=True)
    return found


def remove_oldest(path):
    """Remove the oldest files beside a file, of the same kind, if there are too many."""
    files = sorted(path.parent.glob(f"*{path.suffix}"), key=lambda file: file.stat().st_mtime)
    for file in files[:-_MOST_KEPT]:
        file.unlink(missing_ok=True)
