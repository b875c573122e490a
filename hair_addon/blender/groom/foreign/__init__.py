# SPDX-License-Identifier: GPL-3.0-or-later
"""Curves and particles not created by Vellus, which become guides or hair."""

from typing import TYPE_CHECKING

from ....core.lazy import submodules

if TYPE_CHECKING:
    from . import (
        foreign_curves,
        hand_made_guides,
        joined_curves,
        kept_following,
        kept_hair,
        kept_thickness,
        particle_hair,
    )
else:
    __getattr__ = submodules(__name__)
