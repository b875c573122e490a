# SPDX-License-Identifier: GPL-3.0-or-later
"""The kinds of styles by their names in files and in Blender, the entries of the menu, and the classes of settings.

`from kinds import *` gives the classes of settings, as `api` does: `Curl(radius=0.004)`.
"""

import copy
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np

from ..errors import HairError
from ..params import declared, described
from . import bend, braid, clump, curl, frizz, lean, smooth, trim, wet
from .base import Cutter, Step, StyleSettings

__all__ = ["Bend", "Braid", "Clump", "Curl", "Frizz", "Lean", "Smooth", "Trim", "Wet"]

# The classes of settings by their names in `api`, written out for type checkers.
Trim, Clump, Curl, Frizz, Bend = trim.Settings, clump.Settings, curl.Settings, frizz.Settings, bend.Settings
Smooth, Lean, Braid, Wet = smooth.Settings, lean.Settings, braid.Settings, wet.Settings

_MODULES: dict[str, Any] = {
    "TRIM": trim,
    "CLUMP": clump,
    "CURL": curl,
    "FRIZZ": frizz,
    "BEND": bend,
    "SMOOTH": smooth,
    "LEAN": lean,
    "BRAID": braid,
    "WET": wet,
}

# The kinds of steps, in the order of their numbers in kernels. The text of a step is a file of its name: bend.strand.
STEPS: dict[str, Any] = {module.STEP: module for module in _MODULES.values() if hasattr(module, "STEP")}
STEP_KINDS = {step: number for number, step in enumerate(STEPS, start=1)}

KINDS: dict[str, type[StyleSettings]] = {kind: module.Settings for kind, module in _MODULES.items()}
LABELS = {kind: module.LABEL for kind, module in _MODULES.items()}
DESCRIPTIONS = {kind: module.DESCRIPTION for kind, module in _MODULES.items()}

MOST_STYLES = 64  # on one hair


@dataclass(frozen=True)
class Offer:
    """An entry of the menu of new styles: a kind, and settings that differ from its defaults."""

    label: str
    kind: str
    changes: dict[str, Any] = field(default_factory=dict)

    @property
    def settings(self) -> StyleSettings:
        """The settings of an added style, except its seed."""
        return KINDS[self.kind](**self.changes)


OFFERS = {
    "TRIM": Offer("Trim", "TRIM"),
    "CLUMP": Offer("Clump", "CLUMP"),
    "CURL": Offer("Curl", "CURL"),
    "WAVE": Offer("Wave", "CURL", curl.WAVE),
    "FRIZZ": Offer("Frizz", "FRIZZ"),
    "BEND": Offer("Bend", "BEND"),
    "ROLL": Offer("Roll", "BEND", bend.ROLL),
    "SMOOTH": Offer("Smooth", "SMOOTH"),
    "STRAIGHTEN": Offer("Straighten", "SMOOTH", smooth.STRAIGHTEN),
    "LEAN": Offer("Lean", "LEAN"),
    "LIFT": Offer("Lift", "LEAN", lean.LIFT),
    "BRAID": Offer("Braid", "BRAID"),
    "ROPE": Offer("Rope", "BRAID", {"pattern": "ROPE"}),
    "WET": Offer("Wet", "WET"),
}


def kind_of(settings: StyleSettings) -> str:
    """Return the kind of a style's settings, such as CURL. Raises `HairError` for anything else."""
    for kind, settings_class in KINDS.items():
        if type(settings) is settings_class:
            return kind
    raise HairError(f"A style must be the settings of a style, not {described(settings)}.")


def module_of(settings: StyleSettings) -> Any:
    """Return the module of a style's settings. Raises `HairError` for anything else."""
    return _MODULES[kind_of(settings)]


def needs_centre(step: str) -> bool:
    """Return whether a kind of step acts only on strands with a clump center."""
    return hasattr(STEPS[step], "NEEDS_CENTRE")


def steps_of(settings: StyleSettings, cutters: Mapping[str, Cutter]) -> list[Step]:
    """Return the steps of a style on strands, none for a style on guides; levels count from the style's first.

    cutters: planes by their names in Trim styles.
    """
    module = module_of(settings)
    return module.steps(settings, cutters) if hasattr(module, "steps") else []


def varied_settings_of(kind: str) -> tuple[str, ...]:
    """Return the settings of a kind of style that may differ between strands, as declared."""
    return tuple(name for name, _default, details in declared(KINDS[kind]) if details.may_vary)


@cache
def varied_numbers_of(step: str) -> frozenset[str]:
    """Return the numbers of a kind of step that may differ between strands."""
    found: set[str] = set()
    for kind, settings_class in KINDS.items():
        settings = settings_class()
        values = {name: np.array([getattr(settings, name)]) for name in varied_settings_of(kind)}
        for made in steps_of(with_values(settings, values), {}):
            if made.kind == step:
                found |= {name for name, value in made.numbers.items() if isinstance(value, np.ndarray)}
    return frozenset(found)


def with_values(settings: StyleSettings, values: Mapping[str, np.ndarray]) -> Any:
    """Return a copy of a style's settings with arrays (S,) in place of some values; they are not checked."""
    found = copy.copy(settings)
    for name, value in values.items():
        object.__setattr__(found, name, value)  # the class is frozen
    return found
