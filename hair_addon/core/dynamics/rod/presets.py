# SPDX-License-Identifier: GPL-3.0-or-later
"""Named kinds of hair in motion, as data: {identifier: (label, tooltip, settings that differ from their defaults)}.

A preset sets how hair moves, and leaves alone what it is moved by, what it collides with, and how it is computed.
"""

from dataclasses import replace
from typing import Any

from ...params import declared
from .settings import DynamicsSettings

# In the order of a menu.
PRESETS: dict[str, tuple[str, str, dict[str, Any]]] = {
    "NATURAL": ("Natural", "Dry hair that swings freely and keeps its shape", {}),
    "LOOSE": ("Loose", "Single fibers that bend easily", {"bend_stiffness": 1.0}),
    "STYLED": (
        "Styled",
        "Hair with styling products, pulled back to its combed shape",
        {"bend_stiffness": 100.0, "hold": 20.0},
    ),
    "SHORT_FUR": ("Short Fur", "Stiff hair that stands", {"bend_stiffness": 1000.0}),
    "WET": ("Wet", "Heavy, soft hair that feels less air", {"wetness": 1.0}),
}

# What presets set.
NAMES = (
    *("bend_stiffness", "twist_stiffness", "stretch_stiffness", "tip_stiffness", "damping", "weight", "wetness"),
    *("hold", "hold_tip"),
)


def applied(settings: DynamicsSettings, identifier: str) -> DynamicsSettings:
    """`DynamicsSettings` with those of a preset."""
    defaults = {name: default for name, default, _details in declared(DynamicsSettings) if name in NAMES}
    return replace(settings, **defaults | PRESETS[identifier][2])
