# SPDX-License-Identifier: GPL-3.0-or-later
"""Lazy imports: files of a package are imported on first use, because importing Warp is slow.

The `__init__` of a package sets `__getattr__ = submodules(__name__)`, and may import its files under `TYPE_CHECKING`
for type checkers. With `from ..core import geometry` at the top of a file, the call
`geometry.transform.transformed(…)` in a function imports transform.py, and Warp with it, when it first runs.
`Package` is a proxy for a package that may be missing, such as `bpy` outside Blender.
"""

import importlib
from collections.abc import Callable
from types import ModuleType
from typing import Any


def submodules(package: str) -> Callable[[str], ModuleType]:
    """Return a package's `__getattr__`, which imports its files; package: its `__name__`."""

    def imported(name):
        full_name = f"{package}.{name}"
        try:
            return importlib.import_module(full_name)
        except ModuleNotFoundError as error:
            if error.name != full_name:
                raise
            raise AttributeError(f"module {package!r} has no attribute {name!r}", name=name) from None

    return imported


class Package:
    """A package that is imported on first attribute access; name: relative to the package `within`."""

    def __init__(self, name: str, within: str | None) -> None:
        self._name, self._within = name, within

    def __getattr__(self, name: str) -> Any:
        return getattr(importlib.import_module(self._name, self._within), name)
