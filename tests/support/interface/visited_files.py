# SPDX-License-Identifier: GPL-3.0-or-later
"""Trace of the add-on's files that the program visits."""

import sys
import threading
from pathlib import Path

import hair_addon

ADDON = Path(hair_addon.__file__).resolve().parent

# The package that launches kernels counts as one file, and calls to it are never returns: it calls no other package.
LAUNCHING = "core/kernels"

# A container of values is ignored, like a dictionary.
CONTAINER = "blender/host/caches.py"

# Code that only converts errors to messages is ignored, like a try statement.
SENTENCES = {"core/errors.py", "blender/gpu/driver_textures.py"}


class Trace:
    """Files in order of their first call, in all threads, while it is entered as a context; it can be entered again.

    The package LAUNCHING counts as one file. A return is a call from a file to another that was visited before it;
    (caller, called) counts once. Ends of functions are not returns.
    """

    def __init__(self):
        self.files = []
        self.calls = {}  # (caller, called) → names of functions

    def __enter__(self):
        threading.setprofile(self._see)
        sys.setprofile(self._see)
        return self

    def __exit__(self, *_error):
        sys.setprofile(None)
        threading.setprofile(None)

    @property
    def returns(self):
        """Return [(caller, called)]."""
        order = {file: number for number, file in enumerate(self.files)}
        calls = [call for call in self.calls if call[0] in order and call[1] != LAUNCHING]
        return [(caller, called) for caller, called in calls if order[called] < order[caller]]

    def __str__(self):
        lines = [f"{len(self.files)} files, {len(self.returns)} returns"]
        for file in self.files:
            by = {caller: names for (caller, called), names in self.calls.items() if called == file}
            lines.append(f"  {file}")
            lines += [f"    {caller}: {', '.join(sorted(names))}" for caller, names in by.items()]
        lines += [f"  back from {caller} to {called}" for caller, called in self.returns]
        return "\n".join(lines)

    def _see(self, frame, event, _argument):
        file = _file_of(frame)
        if event != "call" or file is None:
            return
        if file not in self.files:
            self.files.append(file)
        caller = frame.f_back
        while caller is not None and _file_of(caller) is None:
            caller = caller.f_back
        if caller is not None and _file_of(caller) != file:
            self.calls.setdefault((_file_of(caller), file), set()).add(frame.f_code.co_qualname)


def _file_of(frame):
    path = Path(frame.f_code.co_filename)
    if not path.is_relative_to(ADDON) or frame.f_code.co_name == "<module>":
        return None
    name = path.relative_to(ADDON).as_posix()
    if name == CONTAINER or name in SENTENCES:
        return None
    return LAUNCHING if name.startswith(f"{LAUNCHING}/") else name
