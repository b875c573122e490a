# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides gathered at ties: the way over the surface, through the tie, and onward along a drawn line."""

from typing import TYPE_CHECKING

from ...lazy import submodules

if TYPE_CHECKING:
    from . import (
        buns,
        cornrows,
        gather_settings,
        gathering,
        raised_segments,
        tie_tails,
    )
else:
    __getattr__ = submodules(__name__)
