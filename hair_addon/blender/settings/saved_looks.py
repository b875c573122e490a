# SPDX-License-Identifier: GPL-3.0-or-later
"""User-saved looks, for every file: JSON in the add-on's folder.

Blender's presets are Python scripts, which it runs; a look is numbers, so it is read as numbers.
"""

from dataclasses import asdict
from pathlib import Path

import bpy

from ...core.errors import HairError
from ...core.files import settings_file
from ...core.params import declared
from ...core.shading.appearance import Appearance
from . import preferences


def names():
    """Names of all saved looks, in alphabetical order; no file is read."""
    folder = _folder(create=False)
    found = folder.glob("*.json") if folder is not None and folder.is_dir() else ()
    return sorted((path.stem for path in found), key=str.casefold)


def change_time(name):
    """When the file of a look was last written [ns], 0 where there is none."""
    try:
        return _path(name, create=False).stat().st_mtime_ns
    except OSError:
        return 0


def write(name, look):
    """Save an `Appearance` under a name, replacing an existing look. Raises `HairError`."""
    settings_file.write_object(_path(name, create=True), {"version": 1, **asdict(look)})


def read(name):
    """Read the `Appearance` of a name; omitted settings have their defaults. Raises `HairError`.

    Unknown settings of a newer Vellus are ignored.
    """
    path = _path(name, create=False)
    found = settings_file.read_object(path)
    known = {key: found[key] for key, _default, _details in declared(Appearance) if key in found}
    return settings_file.to_settings(known, Appearance, path)


def remove(name):
    """Delete a saved look permanently. Raises `HairError`."""
    try:
        _path(name, create=False).unlink()
    except OSError as error:
        raise HairError("The look cannot be removed: {cause}.", cause=error) from error


def _path(name, create):
    folder = _folder(create)
    if folder is None:
        raise HairError("Looks can be saved only by the installed extension: install it.")
    stem = bpy.path.clean_name(name.strip())  # no separators, no paths out of the folder
    if not stem.strip("_."):
        raise HairError("The look has no name: type one.")
    return folder / f"{stem}.json"


def _folder(create):
    """None where we are no extension."""
    if not preferences.is_extension():
        return None
    folder = bpy.utils.extension_path_user(preferences.ADDON_MODULE, path="looks", create=create)
    return Path(folder) if folder else None
