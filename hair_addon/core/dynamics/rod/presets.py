# SPDX-License-Identifier: GPL-3.0-or-later
"""Presets of dynamics: {identifier: (label, tooltip, settings that differ from their defaults)}.

A preset sets the material of the hair. It does not change external forces, collisions or the solver.
"""

from dataclasses import replace
from typing import Any

from ...params import declared
from .settings import DynamicsSettings

# In the order of the menu.
PRESETS: dict[str, tuple[str, str, dict[str, Any]]] = {
    "NATURAL": ("Natural", "Dry hair that swings freely and keeps its shape", {}),
    "LOOSE": ("Loose", "Single fibers that bend easily", {"bend_stiffness": 1.0}),
    "STYLED": (
        "Styled",
        "Hair with styling products, pulled back to its combed shape",
        {"bend_stiffness": 100.0, "hold": 20.0},
    ),
    "SHORT_FUR": ("Short Fur", "Stiff hair that stands", {"bend_stiffness": 1000.0}),
    "WET": ("Wet", "Heavy, soft hair with less air drag", {"wetness": 1.0}),
}

# Settings that presets change.
NAMES = (
    *("bend_stiffness", "twist_stiffness", "stretch_stiffness", "tip_stiffness", "damping", "weight", "wetness"),
    *("hold", "hold_tip"),
)


def applied(settings: DynamicsSettings, identifier: str) -> DynamicsSettings:
    """Return `DynamicsSettings` with the values of a preset."""
    defaults = {name: default for name, default, _details in declared(DynamicsSettings) if name in NAMES}
    return replace(settings, **defaults | PRESETS[identifier][2])
