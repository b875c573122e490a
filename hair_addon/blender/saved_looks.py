# SPDX-License-Identifier: GPL-3.0-or-later
"""Looks that an artist saved, for every file: JSON in the add-on's own folder.

Blender's presets are Python scripts, which it runs; a look is numbers, so it is read as numbers.
"""

from dataclasses import asdict
from pathlib import Path

import bpy

from ..core import settings_file
from ..core.errors import HairError
from ..core.params import declared
from ..core.shading.appearance import Appearance
from . import preferences


def names():
    """Names of all saved looks, in alphabetical order; no file is read."""
    folder = _folder(create=False)
    found = folder.glob("*.json") if folder is not None and folder.is_dir() else ()
    return sorted((path.stem for path in found), key=str.casefold)


def write(name, look):
    """Save an `Appearance` under a name, in place of what had it. Raises `HairError`."""
    settings_file.write_object(_path(name, create=True), {"version": 1, **asdict(look)})


def read(name):
    """The `Appearance` of a name; what the file does not say is at its default. Raises `HairError`.

    Of what a newer Vellus saved, it takes what it knows.
    """
    path = _path(name, create=False)
    found = settings_file.read_object(path)
    known = {key: found[key] for key, _default, _details in declared(Appearance) if key in found}
    return settings_file.to_settings(known, Appearance, path)


def remove(name):
    """Remove a saved look for good. Raises `HairError`."""
    try:
        _path(name, create=False).unlink()
    except OSError as error:
        raise HairError("The look cannot be removed: {cause}.", cause=error) from error


def _path(name, create):
    folder = _folder(create)
    if folder is None:
        raise HairError("Looks are saved by the installed extension only: install it.")
    stem = bpy.path.clean_name(name.strip())  # no separators, no dots that lead out of the folder
    if not stem.strip("_."):
        raise HairError("The look has no name: type one.")
    return folder / f"{stem}.json"


def _folder(create):
    """None where we are no extension."""
    if not preferences.is_extension():
        return None
    folder = bpy.utils.extension_path_user(preferences.ADDON_MODULE, path="looks", create=create)
    return Path(folder) if folder else None
