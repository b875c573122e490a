# SPDX-License-Identifier: GPL-3.0-or-later
"""Styles of a hair: adding, fitting and painting them, and diagnostics of styles without effect."""

from typing import TYPE_CHECKING

from ....core.lazy import submodules

if TYPE_CHECKING:
    from . import (
        hair_styles,
        painted_maps,
        painted_masks,
        style_notes,
    )
else:
    __getattr__ = submodules(__name__)
