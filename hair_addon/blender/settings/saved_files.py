# SPDX-License-Identifier: GPL-3.0-or-later
"""Named JSON files of the user, available in every .blend file, in a folder of the extension."""

from pathlib import Path

import bpy

from ...core.errors import HairError
from ...core.files.file_names import stem_of
from . import preferences


class SavedFiles:
    """The files in one folder, such as looks."""

    def __init__(self, folder_name):
        self._folder_name = folder_name

    def names(self):
        """Names of all files, in alphabetical order; no file is read."""
        folder = self.folder(create=False)
        found = folder.glob("*.json") if folder is not None and folder.is_dir() else ()
        return sorted((path.stem for path in found), key=str.casefold)

    def change_time(self, name):
        """Time of the last write to a file [ns]; 0 if it does not exist."""
        try:
            return self.path(name, create=False).stat().st_mtime_ns
        except OSError:
            return 0

    def path(self, name, create):
        """Return the path of a file by name; create: whether to create its folder. Raises `HairError`."""
        folder = self.folder(create)
        if folder is None:
            raise HairError("Only the installed extension can save looks and styles: install it.")
        stem = stem_of(name)  # rejects separators and paths outside the folder
        if not stem.strip("_. "):
            raise HairError("The name is empty: type one.")
        return folder / f"{stem}.json"

    def remove(self, name):
        """Delete a file permanently. Raises `HairError`."""
        try:
            self.path(name, create=False).unlink()
        except OSError as error:
            raise HairError("{name} cannot be removed: {cause}.", name=name, cause=error) from error

    def folder(self, create):
        """Folder of the files; None when not run as an extension."""
        if not preferences.is_extension():
            return None
        folder = bpy.utils.extension_path_user(preferences.ADDON_MODULE, path=self._folder_name, create=create)
        return Path(folder) if folder else None
