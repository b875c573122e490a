# SPDX-License-Identifier: GPL-3.0-or-later
"""Paths that a .blend or a user names, operators that this Blender has, and the version that goes into file headers."""

import contextlib
import os
import re
import tomllib
from functools import cache
from pathlib import Path

import bpy

from ...core.errors import HairError

# Two slashes of either kind, or the name by which Windows knows its devices, of which networks are one.
_ELSEWHERE = re.compile(r"[\\/]([\\/]|\?\?[\\/])")


def resolve(path, library=None):
    """A path of Blender's, `//` and all, as an absolute `Path`. Raises `HairError` for one that leads nowhere.

    library: the `bpy.types.Library` whose path it is; None for the open file.
    """
    if not path.strip("/"):
        raise HairError("No file or folder was given: pick one.")
    if "\0" in path:
        raise HairError("The path contains an invalid character: type it again.")
    if path.startswith("//") and library is None and not bpy.data.filepath:
        raise HairError("{path} is relative to the .blend file: save the file first.", path=path)
    if names_other_computer(path):
        sentence = "{path} is on another computer, where Vellus neither reads nor writes: pick a local folder."
        raise HairError(sentence, path=path)
    return Path(bpy.path.abspath(path, library=library)).resolve()


def names_other_computer(path):
    """Whether Windows would look for a path of Blender's on another computer: a .blend could so learn who opens it.

    Either slash counts there, and a path below `//` that begins with one is not below it. One that is relative to a
    file on another computer is where the artist has the file.
    """
    return _ELSEWHERE.match(path.removeprefix("//")) is not None


def from_open_file(library):
    """The path of a `bpy.types.Library` from the folder of the open file, so that a project may be moved as a whole.

    Absolute where there is none: the file was never saved, or the library is on another drive.
    """
    path = os.path.normpath(bpy.path.abspath(library.filepath))
    return relative(path, os.path.dirname(bpy.data.filepath)) if bpy.data.filepath else Path(path).as_posix()


def of_library(library):
    """The file of a `bpy.types.Library` as an absolute `Path`, in the folder that it is really in."""
    file = Path(bpy.path.abspath(library.filepath))
    return file.parent.resolve() / file.name


def relative(path, folder):
    """An absolute path as seen from a folder, with slashes; as it is where it is on another drive."""
    with contextlib.suppress(ValueError):
        path = os.path.relpath(path, folder)
    return Path(path).as_posix()


def has_operator(name):
    """Whether this Blender has an operator such as "wm.usd_import": some are built without, some are in add-ons."""
    category, operator = name.split(".")
    return operator in dir(getattr(bpy.ops, category))


@cache
def addon_version():
    """The version in blender_manifest.toml."""
    manifest = Path(__file__).resolve().parents[3] / "blender_manifest.toml"
    return tomllib.loads(manifest.read_text(encoding="utf-8"))["version"]
