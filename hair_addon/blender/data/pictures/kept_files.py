# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that are made once and kept: in the extension's user folder, or until Blender quits."""

import os
import shutil
import tempfile
import time
from pathlib import Path

import bpy

from ...settings import preferences

_MOST_KEPT = 64  # files
_ABANDONED = 86400.0  # age [s] of the folder of a job that was killed


def folder(name):
    """Return the folder for files of a kind."""
    if preferences.is_extension():
        found = bpy.utils.extension_path_user(preferences.ADDON_MODULE, path=name, create=True)
        # Empty if Blender could not create it, which it reports on the console.
        if found and os.access(found, os.W_OK):
            return Path(found)
    found = Path(bpy.app.tempdir or tempfile.gettempdir()) / f"vellus_{name}"
    found.mkdir(exist_ok=True)
    return found


def remove_oldest(path, used=frozenset()):
    """Remove the oldest files with the suffix of a file from its folder, if there are too many; `used` files stay."""
    files = [file for file in path.parent.glob(f"*{path.suffix}") if file not in used]
    for file in sorted(files, key=_time_of)[:-_MOST_KEPT]:
        file.unlink(missing_ok=True)


def new_job(folder):
    """Return a new folder of a job in a folder of files, and remove those of jobs that were killed long ago."""
    for job in folder.glob(".*"):
        if job.is_dir() and time.time() - _time_of(job) > _ABANDONED:
            shutil.rmtree(job, ignore_errors=True)
    return Path(tempfile.mkdtemp(prefix=".", dir=folder))


def _time_of(file):
    """Return the time of a file's last change [s], 0 if another process has removed it."""
    try:
        return file.stat().st_mtime
    except OSError:
        return 0.0
