# SPDX-License-Identifier: GPL-3.0-or-later
"""Disk cache of baked tables: the name of each set is derived from its settings.

A cached set is used only if it is complete, its texels match the digest in its header, and its settings match the
request; otherwise it is baked again and replaced. Other files in the folder are never changed.
"""

import contextlib
import hashlib
import json
import re
import shutil
import time
from dataclasses import asdict
from pathlib import Path

from ..errors import HairError
from ..shading.tables import lookup_tables
from . import table_exr
from .atomic_file import atomic_file

CAPACITY = 64  # sets of some 2 MB

_NAME = re.compile(r"tables-[0-9a-f]{32}")


def tables(
    folder: Path, settings: lookup_tables.Settings, version: str, *, device: str = "cpu", capacity: int = CAPACITY
) -> lookup_tables.Tables:
    """Return `lookup_tables.Tables` of these settings from the folder; bakes and stores them if missing.

    version: of the project, part of the name; capacity: number of sets, beyond which the least recently used are
    removed. If the folder cannot be written, tables are returned without being stored.
    """
    place = Path(folder) / _name(settings, version)
    try:
        found = table_exr.read_tables(place)
    except HairError:  # missing or damaged
        found = None
    if found is not None and found.settings == settings:
        _mark_used(place)
        return found
    baked = lookup_tables.bake(settings, device)
    try:
        table_exr.write_tables(place, baked, version)
    except HairError:
        return baked
    _mark_used(place)
    _make_room(Path(folder), capacity)
    return baked


def _name(settings, version):
    text = json.dumps([table_exr.FORMAT_VERSION, version, asdict(settings)])
    return "tables-" + hashlib.sha256(text.encode()).hexdigest()[:32]


def _mark_used(place):
    """Update the time of last use in a set's `used` file; a read-only folder is left unchanged."""
    with contextlib.suppress(HairError), atomic_file(place / "used", is_forced=False) as partial:
        partial.write_text(str(time.time_ns()))


def _last_used(place):
    try:
        return int((place / "used").read_text())
    except (OSError, ValueError):
        return 0


def _make_room(folder, capacity):
    sets = [path for path in folder.iterdir() if _NAME.fullmatch(path.name) and path.is_dir() and not path.is_symlink()]
    for place in sorted(sets, key=_last_used, reverse=True)[capacity:]:
        shutil.rmtree(place, ignore_errors=True)  # another Blender may be reading it
