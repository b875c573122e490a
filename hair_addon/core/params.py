# SPDX-License-Identifier: GPL-3.0-or-later
"""A setting is declared once: default, range, unit and tooltip stand together in a frozen `Settings` dataclass.

Blender's properties, the panel's rows, the command line's options and the checks below all follow from it.
"""

import math
from dataclasses import dataclass, field, fields

from .errors import HairError


@dataclass(frozen=True)
class Param:
    """What is known of a setting beside its name, type and default."""

    description: str
    label: str = ""  # empty: the field's name in words
    low: float = -math.inf  # smallest allowed value
    above: float = -math.inf  # largest forbidden value below the range, for settings such as a positive distance
    high: float = math.inf
    soft_high: float = math.inf  # where a slider ends; larger values may be typed
    unit: str = "NONE"  # Blender's names: LENGTH, ROTATION
    subtype: str = "NONE"  # Blender's names: ANGLE, DISTANCE, FACTOR, COLOR
    precision: int = 3
    choices: tuple[tuple[str, str, str], ...] = ()  # (value, label, tooltip) of an enumeration


def param(default, description, **details):
    """A dataclass field that carries a `Param`; `details` are its other attributes."""
    return field(default=default, metadata={"param": Param(description, **details)})


def declared(settings_class):
    """[(name, default, Param)] of a `Settings` class, in the order of declaration."""
    return [(f.name, f.default, f.metadata["param"]) for f in fields(settings_class)]


def label_of(name, details):
    """The words an artist reads: the declared label, or the field's name."""
    return details.label or name.replace("_", " ").capitalize()


def unit_of(details):
    """The unit of a setting in a file or on a command line, empty where it has none."""
    return {"ROTATION": "rad", "LENGTH": "m"}.get(details.unit, "")


def like(default, value):
    """A value that JSON gave, as the type of a setting's default; raises TypeError or ValueError for another kind."""
    if isinstance(default, tuple) and isinstance(value, list):
        return tuple(like(example, component) for example, component in zip(default, value, strict=True))
    if isinstance(default, float) and type(value) is int:
        return float(value)
    if type(value) is not type(default):
        raise TypeError(f"{value!r} in place of {default!r}")
    return value


@dataclass(frozen=True)
class Settings:
    """Base of every stage's settings. Making one with a value outside its range raises `HairError`."""

    def __post_init__(self):
        for name, default, details in declared(type(self)):
            _check(label_of(name, details), getattr(self, name), default, details)


def _check(label, value, default, details):
    if isinstance(default, str):
        allowed = [choice[0] for choice in details.choices]
        if allowed and value not in allowed:
            raise HairError(f"{label} must be one of {', '.join(allowed)}, not {value!r}.")
        return
    if isinstance(default, bool):
        return
    components = value if isinstance(default, tuple) else (value,)
    if isinstance(default, tuple) and len(components) != len(default):
        raise HairError(f"{label} needs {len(default)} numbers, not {len(components)}.")
    for component in components:
        if isinstance(default, int) and component != int(component if math.isfinite(component) else 0):
            raise HairError(f"{label} must be a whole number, not {component:g}.")
        # Written so that NaN fails too: every comparison with it is false.
        if not (math.isfinite(component) and details.low <= component <= details.high and component > details.above):
            raise HairError(f"{label} must be {_range(details)}, not {component:g}.")


def _range(details):
    if math.isfinite(details.above):
        lower = "positive" if details.above == 0.0 else f"above {details.above:g}"
        return lower + (f" and at most {details.high:g}" if math.isfinite(details.high) else "")
    if math.isfinite(details.low) and math.isfinite(details.high):
        return f"between {details.low:g} and {details.high:g}"
    if math.isfinite(details.low):
        return f"at least {details.low:g}"
    if math.isfinite(details.high):
        return f"at most {details.high:g}"
    return "a finite number"
