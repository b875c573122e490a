# SPDX-License-Identifier: GPL-3.0-or-later
"""Paths of a command: a leading // stands for the folder of the .blend file, as in Blender."""

import os
from pathlib import Path

from ..core.errors import HairError

_OPTIONS = ("out", "settings", "guides_from", "hair_from", "from_library", "deliver", "textures")


def resolve(given):
    """Convert each path option to a `Path`. Raises `HairError` for // without a .blend file."""
    blend = None
    if getattr(given, "input", None) is not None:
        given.input = _resolved(given.input, None, "give the path of the file itself")
        blend = given.input if given.input.suffix.lower() == ".blend" else None
    for name in _OPTIONS:
        if getattr(given, name, None) is not None:
            setattr(given, name, _resolved(getattr(given, name), blend, "give the whole path"))


def _resolved(text, blend, instead):
    if not text.startswith("//"):
        return Path(text)
    if blend is None:
        raise HairError(f"{text} begins with //, the folder of the .blend, and there is none: {instead}.")
    return Path(os.path.normpath(blend.absolute().parent / text.lstrip("/")))
