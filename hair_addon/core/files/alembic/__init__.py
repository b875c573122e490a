# SPDX-License-Identifier: GPL-3.0-or-later
"""Alembic archives [Alembic26]: their container, curves and grooms, written and read."""

from typing import TYPE_CHECKING

from ...lazy import submodules

if TYPE_CHECKING:
    from . import curves, grooms, ogawa, reader, shapes, transforms, unreal_groom, writer
else:
    __getattr__ = submodules(__name__)
