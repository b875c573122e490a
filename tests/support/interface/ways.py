# SPDX-License-Identifier: GPL-3.0-or-later
"""The way that the program takes through the files of the add-on while something happens."""

import sys
import threading
from pathlib import Path

import hair_addon

ADDON = Path(hair_addon.__file__).resolve().parent

# What launches any kernel is one place on a way, and no way back: it calls nobody who called it.
LAUNCHING = "core/kernels"

# A container of values is no place, as a dictionary is none.
CONTAINER = "blender/host/caches.py"

# What does nothing but turn an error into a sentence is no place either, as a try statement is none.
SENTENCES = {"core/errors.py", "blender/gpu/driver_textures.py"}


class Way:
    """Files in order of their first call, in all threads, while it is entered as a context; it may be so again.

    A place is a file, or the package of LAUNCHING. A return is a call from a place into another that came before it on
    the way, whoever called that first; (caller, called) counts once. The end of a function is none.
    """

    def __init__(self):
        self.places = []
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
        """[(caller, called)]."""
        order = {place: number for number, place in enumerate(self.places)}
        calls = [call for call in self.calls if call[0] in order and call[1] != LAUNCHING]
        return [(caller, called) for caller, called in calls if order[called] < order[caller]]

    def __str__(self):
        lines = [f"{len(self.places)} places, {len(self.returns)} returns"]
        for place in self.places:
            by = {caller: names for (caller, called), names in self.calls.items() if called == place}
            lines.append(f"  {place}")
            lines += [f"    {caller}: {', '.join(sorted(names))}" for caller, names in by.items()]
        lines += [f"  back from {caller} to {called}" for caller, called in self.returns]
        return "\n".join(lines)

    def _see(self, frame, event, _argument):
        place = _place(frame)
        if event != "call" or place is None:
            return
        if place not in self.places:
            self.places.append(place)
        caller = frame.f_back
        while caller is not None and _place(caller) is None:
            caller = caller.f_back
        if caller is not None and _place(caller) != place:
            self.calls.setdefault((_place(caller), place), set()).add(frame.f_code.co_qualname)


def _place(frame):
    path = Path(frame.f_code.co_filename)
    if not path.is_relative_to(ADDON) or frame.f_code.co_name == "<module>":
        return None
    name = path.relative_to(ADDON).as_posix()
    if name == CONTAINER or name in SENTENCES:
        return None
    return LAUNCHING if name.startswith(f"{LAUNCHING}/") else name
