# SPDX-License-Identifier: GPL-3.0-or-later
"""Named looks of hair, as data: {identifier: (label, Appearance)} in the order of a menu."""

from dataclasses import replace

from .appearance import Appearance, wetted

_BLACK = Appearance(melanin=0.985, redness=0.1, roughness=0.25, random_color=0.02)
_DARK_BROWN = Appearance(melanin=0.88, redness=0.25, random_color=0.05)
_BROWN = Appearance(melanin=0.66, redness=0.25, random_color=0.08)
_LIGHT_BROWN = Appearance(melanin=0.48, redness=0.3, random_color=0.1, random_roughness=0.1)
_BLOND = Appearance(melanin=0.22, redness=0.3, random_color=0.15, random_roughness=0.1)
_AUBURN = Appearance(melanin=0.68, redness=0.8, random_color=0.1)

# Gray hair is a mixture of white and dark strands, and coarser. A little melanin in all strands would make it blond.
_GREY = Appearance(
    parametrization="COLOR", color=(0.02, 0.0185, 0.017), roughness=0.35, random_color=1.0, random_roughness=0.2
)

PRESETS = {
    "BLACK": ("Black", _BLACK),
    "DARK_BROWN": ("Dark Brown", _DARK_BROWN),
    "BROWN": ("Brown", _BROWN),
    "LIGHT_BROWN": ("Light Brown", _LIGHT_BROWN),
    "DARK_BLOND": ("Dark Blond", replace(_BLOND, melanin=0.34)),
    "BLOND": ("Blond", _BLOND),
    "PLATINUM": ("Platinum Blond", replace(_BLOND, melanin=0.08, random_color=0.1)),
    "SUN_BLEACHED": (
        "Sun-Bleached",
        replace(_LIGHT_BROWN, melanin=0.6, redness=0.1, tip_absorption=0.2, gradient_start=0.15, gradient_end=0.9),
    ),
    "AUBURN": ("Auburn", _AUBURN),
    "GINGER": ("Ginger", Appearance(melanin=0.42, redness=0.97, random_color=0.12)),
    "GREY": ("Gray", _GREY),
    "WHITE": ("White", Appearance(melanin=0.02, redness=0.2, roughness=0.35, random_color=0.2)),
    "DYED_BLUE": ("Dyed Blue", Appearance(melanin=0.03, redness=0.3, tint=(0.02, 0.08, 0.6), random_color=0.1)),
    "DYED_PINK": (
        "Pink Tips",
        Appearance(melanin=0.22, redness=0.3, tip_absorption=0.4, tip_tint=(0.8, 0.12, 0.35), gradient_end=0.8),
    ),
    "WET_BLACK": ("Wet Black", wetted(_BLACK, 1.0)),
    "WET_BROWN": ("Wet Brown", wetted(_BROWN, 1.0)),
    "WET_BLOND": ("Wet Blond", wetted(_BLOND, 1.0)),
}
