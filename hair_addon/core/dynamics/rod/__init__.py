# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides as elastic rods: settings, material in SI units, and the solver."""

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
