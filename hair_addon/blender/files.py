# SPDX-License-Identifier: GPL-3.0-or-later
"""Paths that a .blend or a user names, files that appear whole, and the version that goes into file headers."""

import contextlib
import os
import secrets
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


@contextlib.contextmanager
def whole_file(path, partial=None):
    """A path beside `path` to write to: what is written there takes that place in the end, or nothing does.

    partial: that path, where nobody else may write it now; None for one of its own. Raises `HairError` where the folder
    may not be written or its disk is full, of which not every exporter tells.
    """
    path = Path(path)
    if partial is None:
        # In the same folder, or paths relative to the file would be wrong.
        partial = path.with_name(f".vellus_{secrets.token_hex(4)}{path.suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield partial
        require_room(partial, 65_536)
        os.replace(partial, path)
    except (OSError, RuntimeError) as error:
        raise HairError(f"{path} cannot be written: {cause_of(error)}.") from error
    finally:
        with contextlib.suppress(OSError):  # it has moved to its place, or was never made
            partial.unlink()


def partial_of(path):
    """Where a file is written that is claimed: what a process left that was killed is found there, and replaced."""
    return path.with_name(f".vellus_{path.name}")


def require_room(path, byte_count):
    """Raise OSError unless a file can grow by so many bytes; it is left as it was, empty if it was not there."""
    with open(path, "ab") as file:
        size = file.seek(0, os.SEEK_END)
        try:
            for start in range(0, byte_count, 2**20):
                file.write(bytes(min(2**20, byte_count - start)))
            file.flush()
            os.fsync(file.fileno())
        finally:
            file.truncate(size)


def require_writable(path):
    """Raise `HairError` unless a file could be written at `path`: asked before long work."""
    path = Path(path)
    if path.is_dir():
        raise HairError(f"{path} is a folder: name a file.")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        partial = path.with_name(f".vellus_{secrets.token_hex(4)}")
        partial.touch()
        partial.unlink()
    except OSError as error:
        raise HairError(f"{path} cannot be written: {cause_of(error)}.") from error


def has_operator(name):
    """Whether this Blender has an operator such as "wm.usd_import": some are built without, some are in add-ons."""
    category, operator = name.split(".")
    return operator in dir(getattr(bpy.ops, category))


def cause_of(error):
    """In a few words what an error of the system's or of an operator's says."""
    if isinstance(error, OSError) and error.strerror:
        return error.strerror
    lines = [line for line in str(error).splitlines() if line.strip()] or [type(error).__name__]
    # Of an operator in Python Blender hands on the whole traceback, which ends with the error.
    line = lines[-1] if "Traceback" in lines[0] else lines[0]
    return line.strip().removeprefix("Error: ").rstrip(".")


@cache
def addon_version():
    """The version in blender_manifest.toml."""
    manifest = Path(__file__).resolve().parents[2] / "blender_manifest.toml"
    return tomllib.loads(manifest.read_text(encoding="utf-8"))["version"]
