# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides as elastic rods: the artist's settings, material in units of the SI, and the solver."""

from typing import TYPE_CHECKING

from ...lazy import submodules

if TYPE_CHECKING:
    from . import (
        detail,
        material,
        presets,
        rod_solver,
        rods,
        rotations,
        sag_free,
        settings,
        stiffness_advice,
    )
else:
    __getattr__ = submodules(__name__)
