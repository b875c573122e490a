# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames of a sequence, shared among all processes with the same command: no frame is rendered twice.

A frame is done when its files (one per view) exist and are complete: they are written atomically, but another program
may have left an empty file with the same name. A file beside the frames identifies the sequence and the files that the
scene reads, so that another command, or one with another texture, does not continue it.
"""

import contextlib
import hashlib
import json
import os
import time
from pathlib import Path

from ....core.errors import HairError, cause_of
from ....core.files.atomic_file import atomic_file, leftovers, require_writable_path
from ....core.files.file_lock import claim, claim_of
from ....core.imaging import picture_checks
from ....core.long_work import no_progress
from ...data.pictures import rendered_files
from ...host import paths, scene_time
from . import frames, view_files

_VERSION = 1
_PAUSE = 0.5  # [s] between checks for frames of other processes


def description(input_path, engine, settings):
    """Return the description of a sequence, equal for commands with the same result.

    input_path: the open .blend; engine: a key of `frames.ENGINES`; settings: {name: value}. Linked files and images are
    compared by size and modification time: digests of gigabytes of textures would delay each process of a farm by
    minutes.
    """
    with open(input_path, "rb") as file:
        digest = hashlib.file_digest(file, lambda: hashlib.blake2b(digest_size=16)).hexdigest()
    program = f"Vellus {paths.addon_version()}"
    files = rendered_files.states(scene_time.present_scene())
    described = {"sequence": _VERSION, "program": program, "input": digest, "engine": engine, "settings": settings}
    return described | {"files": files}


def begin(pattern, numbers, described, replaces=False):
    """Prepare a sequence; raises `HairError` if the files belong to another one.

    pattern: as in `frames.path_of`; numbers: frame numbers; described: a `description`; replaces: delete existing files
    of these frames.
    """
    record = record_of(pattern)
    require_writable_path(record)
    folder = next((path for path in _files(pattern, numbers) if path.is_dir()), None)
    if folder is not None:
        raise HairError(f"{folder} is a folder: move it, or choose another file name.")
    while True:
        with _claimed(record) as is_ours:
            if is_ours:
                _begin(pattern, numbers, record, described, replaces)
                return
        time.sleep(_PAUSE)


def require_continuable(pattern, numbers, described):
    """Raise `HairError` if `begin` would refuse to continue the files that exist; writes nothing."""
    record = record_of(pattern)
    if record.exists():
        _require_same(record, described)
    else:
        _require_none(pattern, numbers)


@contextlib.contextmanager
def _claimed(path):
    """`claim`, with OSError converted to `HairError`."""
    try:
        with claim(path) as is_ours:
            yield is_ours
    except OSError as error:
        raise HairError(f"{path} cannot be written: {cause_of(error)}.") from error


def record_of(pattern):
    """Return the path of the hidden file that identifies a sequence."""
    pattern = Path(pattern)
    return pattern.with_name(f".{pattern.name}.json")


def _begin(pattern, numbers, record, described, replaces):
    if replaces:
        for path in _files(pattern, numbers):
            path.unlink(missing_ok=True)
    else:
        require_continuable(pattern, numbers, described)
        if record.exists():
            return
    with atomic_file(record) as partial:
        partial.write_text(json.dumps(described, indent=1) + "\n", encoding="utf-8")


def _require_same(record, described):
    try:
        found = json.loads(record.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise HairError(f"{record} cannot be read: remove it, or use --overwrite to start over.") from error
    other = [key for key, value in described.items() if not isinstance(found, dict) or found.get(key) != value]
    if other:
        what = ", ".join(_in_words(key, found, described) for key in other)
        raise HairError(
            f"{record} belongs to another sequence ({what}): choose another name, or use --overwrite to start over."
        )


def _in_words(key, found, described):
    """Describe a difference of sequences: its key, with the differing files for "files"."""
    if key != "files" or not isinstance(found, dict) or not isinstance(found.get(key), dict):
        return key
    before, now = found[key], described[key]
    names = sorted(name for name in {*before, *now} if before.get(name) != now.get(name))
    return f"{key}: {rendered_files.in_short(names)}"


def _require_none(pattern, numbers):
    paths = _files(pattern, numbers)
    there = next((path for path in paths if path.exists() and not picture_checks.is_broken(path)), None)
    if there is not None:
        raise HairError(f"{there} belongs to no known sequence: choose another name, or use --overwrite.")


def make(pattern, numbers, write, progress=no_progress):
    """Render frames not yet rendered or claimed, and wait for claimed ones; yields (number, path) of rendered frames.

    write(path, number): writes a frame atomically; progress(step, part): progress callback, may raise to stop.
    """
    left = list(numbers)
    while left:
        is_idle = True
        for number in list(left):
            progress(f"Frame {number}", 1.0 - len(left) / len(numbers))
            path = frames.path_of(pattern, number)
            if not _is_done(path):
                with _claimed(path) as is_ours:
                    if not is_ours:
                        continue
                    if not _is_done(path):
                        write(path, number)
                        is_idle = False
                        yield number, path
            left.remove(number)
        if left and is_idle:
            time.sleep(_PAUSE)
    _sweep(pattern, numbers)


def missing_frames(pattern, numbers):
    """Numbers of missing frames; removes partial files of killed processes."""
    _sweep(pattern, numbers)
    return unrendered_frames(pattern, numbers)


def unrendered_frames(pattern, numbers):
    """Numbers of frames without complete files; changes nothing."""
    return [number for number in numbers if not _is_done(frames.path_of(pattern, number))]


def _files(pattern, numbers):
    """Files of all frames, in order."""
    return (file for number in numbers for file in view_files.files_of(frames.path_of(pattern, number)))


def _is_done(path):
    return all(map(picture_checks.is_whole, view_files.files_of(path)))


def _sweep(pattern, numbers):
    """Remove partial files of killed processes, for frames that others have rendered since."""
    left = leftovers(Path(pattern).parent)
    for path in [frames.path_of(pattern, number) for number in numbers]:
        partials = [partial for file in view_files.files_of(path) for partial in left.get(file.name, ())]
        if partials or os.path.lexists(claim_of(path)):
            with _claimed(path) as is_ours:
                if is_ours:
                    for partial in partials:
                        partial.unlink(missing_ok=True)
