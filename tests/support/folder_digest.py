# SPDX-License-Identifier: GPL-3.0-or-later
"""Contents of a folder, to check that an operation does not change it."""

import os


def of_folder(folder):
    """Return {path: bytes, or target of a link} of all files in a folder; links to folders are not followed."""
    if folder.is_symlink():
        return {folder: os.readlink(folder)}
    paths = [path for path in sorted(folder.rglob("*")) if path.is_symlink() or path.is_file()]
    return {path: os.readlink(path) if path.is_symlink() else path.read_bytes() for path in paths}
