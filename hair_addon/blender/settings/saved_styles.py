# SPDX-License-Identifier: GPL-3.0-or-later
"""User-saved style presets, for every file: settings files with some sections in the add-on's folder."""

from ...core.files import settings_file, style_presets
from .saved_files import SavedFiles

FILES = SavedFiles("styles")

names, remove = FILES.names, FILES.remove


def all_names():
    """Names of the built-in style presets, then of saved ones."""
    return [*style_presets.PRESETS, *names()]


def write(name, settings):
    """Save the styles of `GroomSettings` under a name, replacing an existing preset. Raises `HairError`."""
    settings_file.write_object(FILES.path(name, create=True), style_presets.to_object(settings))


def read(name):
    """Read the `PartialSettings` of a name. Raises `HairError`."""
    return settings_file.read_partial(FILES.path(name, create=False))
