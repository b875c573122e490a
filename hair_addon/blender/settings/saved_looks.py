# SPDX-License-Identifier: GPL-3.0-or-later
"""User-saved looks, for every file: JSON in the add-on's folder.

Unlike Blender's presets, which are Python scripts that it runs, a look contains only data.
"""

from dataclasses import asdict

from ...core.errors import HairError
from ...core.files import settings_file
from ...core.params import declared
from ...core.shading import presets
from ...core.shading.appearance import Appearance
from .saved_files import SavedFiles

FILES = SavedFiles("looks")

names, change_time, remove = FILES.names, FILES.change_time, FILES.remove


def all_names():
    """Names of the built-in looks, then of saved ones."""
    return [*presets.PRESETS, *names()]


def named(name):
    """Return the built-in or saved `Appearance` of a name, as in the menu. Raises `HairError`."""
    for identifier, (label, look) in presets.PRESETS.items():
        if name.casefold() in (identifier.casefold(), label.casefold()):
            return look
    if name in names():
        return read(name)
    raise HairError('There is no look "{name}": enter a name of the menu Looks.', name=name)


def write(name, look):
    """Save an `Appearance` under a name, replacing an existing look. Raises `HairError`."""
    settings_file.write_object(FILES.path(name, create=True), {"version": 1, **asdict(look)})


def read(name):
    """Read the `Appearance` of a name; omitted settings have their defaults. Raises `HairError`.

    Unknown settings of a newer Vellus are ignored.
    """
    path = FILES.path(name, create=False)
    found = settings_file.read_object(path)
    known = {key: found[key] for key, _default, _details in declared(Appearance) if key in found}
    return settings_file.to_settings(known, Appearance, path)
