# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables that have been baked before, in a folder, each set under a name that follows from its settings.

A cached set is used only if it can be read whole, its texels have the digest in its header, and its settings are those
asked for; otherwise it is baked again and replaced. Nothing else in the folder is ever touched.
"""

import contextlib
import hashlib
import json
import re
import shutil
import time
from dataclasses import asdict
from pathlib import Path

from . import exr
from .errors import HairError
from .shading import lookup_tables

CAPACITY = 64  # sets of some 2 MB

_NAME = re.compile(r"tables-[0-9a-f]{32}")


def tables(folder, settings, version, *, device="cpu", capacity=CAPACITY):
    """`lookup_tables.Tables` of these settings, from the folder or baked now and put there.

    version: of the project, whose bakes may differ; capacity: sets kept, of which those used longest ago give way. A
    folder that cannot be written only costs the next bake.
    """
    place = Path(folder) / _name(settings, version)
    try:
        found = exr.read_tables(place)
    except HairError:  # not there, or damaged: the same is done about both
        found = None
    if found is not None and found.settings == settings:
        _mark_used(place)
        return found
    baked = lookup_tables.bake(settings, device)
    try:
        exr.write_tables(place, baked, version)
    except HairError:
        return baked
    _mark_used(place)
    _make_room(Path(folder), capacity)
    return baked


def _name(settings, version):
    text = json.dumps([exr.FORMAT_VERSION, version, asdict(settings)])
    return "tables-" + hashlib.sha256(text.encode()).hexdigest()[:32]


def _mark_used(place):
    """Set the time of a set's `used` file, by which the oldest is found."""
    with contextlib.suppress(OSError):  # a folder that may only be read keeps its order
        (place / "used").write_text(str(time.time_ns()))


def _last_used(place):
    try:
        return int((place / "used").read_text())
    except (OSError, ValueError):
        return 0


def _make_room(folder, capacity):
    sets = [path for path in folder.iterdir() if _NAME.fullmatch(path.name) and path.is_dir() and not path.is_symlink()]
    for place in sorted(sets, key=_last_used, reverse=True)[capacity:]:
        shutil.rmtree(place, ignore_errors=True)  # another Blender may be reading it
