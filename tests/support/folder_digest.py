# SPDX-License-Identifier: GPL-3.0-or-later
"""What a folder holds, to be compared before and after something that should have left it alone."""

import os


def of_folder(folder):
    """{path: bytes, or where a link leads} of all files in a folder; of a link to one, nothing but that."""
    if folder.is_symlink():
        return {folder: os.readlink(folder)}
    paths = [path for path in sorted(folder.rglob("*")) if path.is_symlink() or path.is_file()]
    return {path: os.readlink(path) if path.is_symlink() else path.read_bytes() for path in paths}
