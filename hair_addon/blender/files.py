# SPDX-License-Identifier: GPL-3.0-or-later
"""Paths that a .blend or a user names, and the version that goes into file headers."""

import tomllib
from functools import cache
from pathlib import Path

import bpy

from ..core.errors import HairError


def resolve(path):
    """A path of Blender's, `//` and all, as an absolute `Path`. Raises `HairError` for one that leads nowhere."""
    if not path.strip("/"):
        raise HairError("No file or folder was named: pick one.")
    if "\0" in path:
        raise HairError("The path holds a character that no file name may have: type it again.")
    if path.startswith("//") and not bpy.data.filepath:
        raise HairError(f"{path} is relative to the .blend file: save that first.")
    if path.startswith("\\\\"):
        raise HairError(f"{path} is on another machine, which Vellus does not write to: pick a folder of this one.")
    return Path(bpy.path.abspath(path)).resolve()


@cache
def addon_version():
    """The version in blender_manifest.toml."""
    manifest = Path(__file__).resolve().parents[2] / "blender_manifest.toml"
    return tomllib.loads(manifest.read_text(encoding="utf-8"))["version"]
