# SPDX-License-Identifier: GPL-3.0-or-later
"""Layers of guides: combing is recorded, layers are composed, and carried to guides that are grown again."""

from typing import TYPE_CHECKING

from ...core.lazy import submodules

if TYPE_CHECKING:
    from . import (
        carried_layers,
        carried_selections,
        carried_variation,
        recording,
    )
else:
    __getattr__ = submodules(__name__)
