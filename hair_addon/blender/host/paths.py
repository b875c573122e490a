# SPDX-License-Identifier: GPL-3.0-or-later
"""Paths given by a .blend file or a user, operators of this Blender, and the add-on's version for file headers."""

import contextlib
import os
import re
import tomllib
from functools import cache
from pathlib import Path

import bpy

from ...core.errors import HairError

# Two slashes of either kind, or Windows' prefix of device paths, which include network paths.
_ELSEWHERE = re.compile(r"[\\/]([\\/]|\?\?[\\/])")


def resolve(path, library=None):
    """Return a Blender path, which may begin with `//`, as an absolute `Path`. Raises `HairError` for invalid paths.

    library: the `bpy.types.Library` that contains the path; None for the open file.
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
    """Whether Windows would look for a Blender path on another computer, so that a .blend could track who opens it.

    Windows accepts either slash, and a path whose `//` is followed by a slash is not relative. Paths relative to a
    file on another computer are accepted, as the artist has opened that file.
    """
    return _ELSEWHERE.match(path.removeprefix("//")) is not None


def from_open_file(library):
    """Return the path of a `bpy.types.Library` relative to the open file's folder, so that a project can be moved as
    a whole.

    Absolute if the file was never saved or the library is on another drive.
    """
    path = os.path.normpath(bpy.path.abspath(library.filepath))
    return relative(path, os.path.dirname(bpy.data.filepath)) if bpy.data.filepath else Path(path).as_posix()


def of_library(library):
    """Return the file of a `bpy.types.Library` as an absolute `Path` with links of its folder resolved."""
    file = Path(bpy.path.abspath(library.filepath))
    return file.parent.resolve() / file.name


def relative(path, folder):
    """Return a path relative to a folder, with forward slashes; absolute if it is on another drive."""
    with contextlib.suppress(ValueError):
        path = os.path.relpath(path, folder)
    return Path(path).as_posix()


def has_operator(name):
    """Whether this Blender has an operator such as "wm.usd_import", which depends on its build and its add-ons."""
    category, operator = name.split(".")
    return operator in dir(getattr(bpy.ops, category))


@cache
def addon_version():
    """Return the version in blender_manifest.toml."""
    manifest = Path(__file__).resolve().parents[3] / "blender_manifest.toml"
    return tomllib.loads(manifest.read_text(encoding="utf-8"))["version"]
