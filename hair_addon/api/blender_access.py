# SPDX-License-Identifier: GPL-3.0-or-later
"""Access of the Python interface to the Blender integration, which is registered on first use."""

import importlib.util
from pathlib import Path
from typing import Any

from ..core import lazy
from ..core.errors import HairError

NO_BLENDER = "This needs Blender: run it in Blender's Python, or install the module bpy."
ARRAYS_ONLY = "This installation of Vellus works on arrays alone: use the extension in Blender, or a checkout."


class RegisteredBlender(lazy.Package):
    """The package `blender`, registered on first access: scripts in a checkout need not register the add-on."""

    def __getattr__(self, name: str) -> Any:
        require_blender()
        require_registered = super().__getattr__("require_registered")
        require_registered()
        return super().__getattr__(name)


def require_blender() -> None:
    """Raise `HairError` if Blender's module or the package's integration is missing."""
    if not (Path(__file__).parents[1] / "blender").is_dir():
        raise HairError(ARRAYS_ONLY)
    try:
        is_there = importlib.util.find_spec("bpy") is not None
    except ValueError:  # a `bpy` module without a spec
        is_there = True
    if not is_there:
        raise HairError(NO_BLENDER)


blender = RegisteredBlender("..blender", __package__)
