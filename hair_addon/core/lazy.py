# SPDX-License-Identifier: GPL-3.0-or-later
"""Lazy imports: files of a package are imported on first use, because importing Warp is slow.

The `__init__` of a package says `__getattr__ = submodules(__name__)`, and may import its files where `TYPE_CHECKING`,
so that a type checker knows them. With `from ..core import geometry` at the top of a file, the call
`geometry.transform.transformed(…)` in a function imports transform.py, and Warp with it, when it first runs.
`Package` stands for a package that may be missing, as Blender's is where there is no Blender.
"""

import importlib
from collections.abc import Callable
from types import ModuleType
from typing import Any


def submodules(package: str) -> Callable[[str], ModuleType]:
    """The `__getattr__` of a package, which imports its files; package: its `__name__`."""

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
    """A package that is imported when something of it is first used; name: relative to the package `within`."""

    def __init__(self, name: str, within: str | None) -> None:
        self._name, self._within = name, within

    def __getattr__(self, name: str) -> Any:
        return getattr(importlib.import_module(self._name, self._within), name)
