# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames of a sequence, shared out among all processes that were given the same command: none is made twice.

A frame is done when its file is there, for files appear whole. What they are frames of stands in a file beside them,
so that another command does not go on with pictures of something else.
"""

import contextlib
import hashlib
import json
import time
from pathlib import Path

from ..core.claims import claim, claim_of
from ..core.errors import HairError
from ..core.long_work import unheard
from . import files, frames

_VERSION = 1
_PAUSE = 0.5  # [s] between looks at what other processes make


def description(input_path, engine, settings):
    """What says whether two commands make the same pictures.

    input_path: the .blend; engine: of `frames.ENGINES`; settings: {name: value}.
    """
    with open(input_path, "rb") as file:
        digest = hashlib.file_digest(file, lambda: hashlib.blake2b(digest_size=16)).hexdigest()
    program = f"Vellus {files.addon_version()}"
    return {"sequence": _VERSION, "program": program, "input": digest, "engine": engine, "settings": settings}


def begin(pattern, numbers, described, replaces=False):
    """Get ready for frames of a sequence; raises `HairError` where there are others than those described.

    pattern: as `frames.path_of` takes it; numbers: of the frames; described: `description`; replaces: drop what is
    there of these frames, and make them again.
    """
    record = record_of(pattern)
    files.require_writable(record)
    while True:
        with _claimed(record) as is_ours:
            if is_ours:
                _begin(pattern, numbers, record, described, replaces)
                return
        time.sleep(_PAUSE)


@contextlib.contextmanager
def _claimed(path):
    """`claim`, with a sentence where the folder takes no further file. Raises `HairError`."""
    try:
        with claim(path) as is_ours:
            yield is_ours
    except OSError as error:
        raise HairError(f"{path} cannot be written: {files.cause_of(error)}.") from error


def record_of(pattern):
    """The file beside a sequence that says what it is of; hidden, so that its folder holds frames alone."""
    pattern = Path(pattern)
    return pattern.with_name(f".{pattern.name}.json")


def _begin(pattern, numbers, record, described, replaces):
    if replaces:
        for number in numbers:
            frames.path_of(pattern, number).unlink(missing_ok=True)
    elif record.exists():
        _require_same(record, described)
        return
    else:
        _require_none(pattern, numbers)
    with files.whole_file(record) as partial:
        partial.write_text(json.dumps(described, indent=1) + "\n", encoding="utf-8")


def _require_same(record, described):
    try:
        found = json.loads(record.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise HairError(f"{record} cannot be read: remove it, or give --overwrite to begin again.") from error
    other = [key for key, value in described.items() if not isinstance(found, dict) or found.get(key) != value]
    if other:
        what = ", ".join(other)
        raise HairError(
            f"{record} is of another sequence ({what}): name other files, or give --overwrite to begin again."
        )


def _require_none(pattern, numbers):
    there = next((path for number in numbers if (path := frames.path_of(pattern, number)).exists()), None)
    if there is not None:
        raise HairError(f"{there} is of no sequence that is known: name other files, or give --overwrite.")


def make(pattern, numbers, write, told=unheard):
    """Make the frames that nobody has made or is making, and wait for those; yields (number, path) of each made here.

    write(path, number): makes one, whole or not at all; told(step, part): told how far the sequence is, may raise to
    stop.
    """
    left = list(numbers)
    while left:
        is_idle = True
        for number in list(left):
            told(f"Frame {number}", 1.0 - len(left) / len(numbers))
            path = frames.path_of(pattern, number)
            if not path.exists():
                with _claimed(path) as is_ours:
                    if not is_ours:
                        continue
                    if not path.exists():
                        write(path, number)
                        is_idle = False
                        yield number, path
            left.remove(number)
        if left and is_idle:
            time.sleep(_PAUSE)
    _sweep(pattern, numbers)


def _sweep(pattern, numbers):
    """Take away what processes left that were killed in the middle of a frame that others have made since."""
    for path in [frames.path_of(pattern, number) for number in numbers]:
        if files.partial_of(path).exists() or claim_of(path).exists():
            with _claimed(path) as is_ours:
                if is_ours:
                    files.partial_of(path).unlink(missing_ok=True)
