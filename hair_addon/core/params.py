# SPDX-License-Identifier: GPL-3.0-or-later
"""Declaration of settings: default, range, unit and tooltip in a frozen `Settings` dataclass.

Blender's properties, panel rows, command-line options and the checks below are derived from this declaration.
"""

import math
import numbers
import re
import reprlib
from collections.abc import Mapping, Set
from dataclasses import dataclass, field, fields, replace
from functools import cache
from typing import Any

import numpy as np

from .errors import HairError

_NO_TEXT = re.compile("[\0\ud800-\udfff]")  # null characters and surrogates


@dataclass(frozen=True)
class Param:
    """Attributes of a setting, apart from its name, type and default."""

    description: str
    label: str = ""  # empty: the field's name in words
    low: float = -math.inf  # smallest allowed value
    above: float = -math.inf  # exclusive lower limit, for settings such as a positive distance
    high: float = math.inf
    soft_high: float = math.inf  # upper end of the slider; larger values can be typed
    unit: str = "NONE"  # Blender's names: LENGTH, ROTATION
    subtype: str = "NONE"  # Blender's names: ANGLE, DISTANCE, FACTOR, COLOR
    precision: int = 3
    choices: tuple[tuple[str, str, str], ...] = ()  # (value, label, tooltip) of an enumeration
    typical: float | None = None  # typical value of a setting that is computed from the surface unless given
    diameter: tuple[str, str] | None = None  # for a radius: property that shows the diameter in mm, its description
    may_vary: bool = False  # whether a map may give each strand a value of its own
    has_course: bool = False  # whether a curve may change the value from root to tip
    is_structural: bool = False  # changes the grouping of strands: not animatable, because strands would jump


def param(default: Any, description: str, **details: Any) -> Any:
    """Return a dataclass field with a `Param`; details: further attributes of the `Param`."""
    return field(default=default, metadata={"param": Param(description, **details)})


def param_from_surface(typical: Any, description: str, **details: Any) -> Any:
    """Return a dataclass field with default None, which core/grooming/groom_defaults.py computes from the surface.

    typical: the value for a human head, in the setting's type.
    """
    return param(None, description, typical=typical, **details)


def param_of(settings_class: type["Settings"], name: str, default: Any = None, **details: Any) -> Any:
    """Return a copy of another class's field; default and details override the declaration."""
    declaration = settings_class.__dataclass_fields__[name]
    metadata = {"param": replace(declaration.metadata["param"], **details)}
    return field(default=declaration.default if default is None else default, metadata=metadata)


def declared(settings_class: type["Settings"]) -> list[tuple[str, Any, Param]]:
    """Return [(name, default, Param)] of a `Settings` class, in the order of declaration.

    The default of a setting that is computed from the surface is its typical value.
    """
    return list(_declared(settings_class))


@cache
def _declared(settings_class):
    described = [(f.name, f.default, f.metadata["param"]) for f in fields(settings_class)]
    return [(name, details.typical if default is None else default, details) for name, default, details in described]


def from_surface(settings_class: type["Settings"]) -> tuple[str, ...]:
    """Return the names of the settings that are computed from the surface unless given."""
    return tuple(name for name, _default, details in declared(settings_class) if details.typical is not None)


def given(settings: "Settings") -> dict[str, Any]:
    """Return {name: value} of `Settings`, without values to be computed from the surface."""
    values = {name: getattr(settings, name) for name, *_ in declared(type(settings))}
    return {name: value for name, value in values.items() if value is not None}


def label_of(name: str, details: Param) -> str:
    """Return the label in the interface: the declared one, or the field's name in words."""
    return details.label or name.replace("_", " ").capitalize()


def unit_of(details: Param) -> str:
    """Return the unit of a setting in files and on the command line, "" for none."""
    return {"ROTATION": "rad", "LENGTH": "m"}.get(details.unit, "")


def is_text(value: str) -> bool:
    """Return whether a str is a valid name or path in Blender: valid UTF-8 without null characters."""
    return not _NO_TEXT.search(value)


def like(default: Any, value: Any) -> Any:
    """Convert a JSON value to the type of a setting's default. Raises TypeError or ValueError for another type."""
    if isinstance(default, tuple) and isinstance(value, list):
        return tuple(like(example, component) for example, component in zip(default, value, strict=True))
    if isinstance(default, float) and type(value) is int:
        return float(value)
    if type(value) is not type(default):
        raise TypeError(f"{value!r} in place of {default!r}")
    return value


@dataclass(frozen=True)
class Settings:
    """Base class of each stage's settings. Values are converted to plain Python values of their defaults' types.

    Accepts integral floats for int, NumPy scalars, and any sequence for a tuple. Raises `HairError` for a value of
    another type or outside its range.
    """

    def __post_init__(self) -> None:
        for name, default, details in declared(type(self)):
            value = getattr(self, name)
            if value is None and details.typical is not None:
                continue
            value = plain_value(label_of(name, details), value, default, details)
            object.__setattr__(self, name, value)  # the class is frozen


def require_class(value: object, settings_class: type, name: str) -> None:
    """Raise `HairError` unless a value is an instance of a settings class; name: the argument's name."""
    if not isinstance(value, settings_class):
        module = settings_class.__module__.rpartition(".")[2]
        raise HairError(f"{name} must be {module}.{settings_class.__name__}, not {described(value)}.")


def described(value: object) -> str:
    """Return a description of a value of any type, on one line."""
    if isinstance(value, str):
        return reprlib.repr(value)
    if value is None or isinstance(value, bool | np.bool_):
        return str(value)
    if isinstance(value, numbers.Real):
        return f"{_as_float(value):g}"
    return f"a value of type {type(value).__name__}"


def array_of(given: Any, dtype: type | None = None) -> np.ndarray | None:
    """Return a script's values as an array; None if NumPy cannot convert them."""
    try:
        with np.errstate(over="ignore"):  # values beyond single precision become infinite
            return np.asarray(given, dtype)
    except (TypeError, ValueError, OverflowError, RuntimeError):  # ragged rows; tensors with gradients
        return None


def plain_value(label: str, value: Any, default: Any, details: Param) -> Any:
    """Convert a value to the type of a setting's default and check its range. Raises `HairError`."""
    if isinstance(default, str):
        return _plain_text(label, value, details)
    if isinstance(default, bool):
        if not isinstance(value, bool | np.bool_):
            raise HairError(f"{label} must be True or False, not {described(value)}.")
        return bool(value)
    if not isinstance(default, tuple):
        return _plain_number(label, value, isinstance(default, int), details)
    count = _length(value)
    if count != len(default):
        raise HairError(f"{label} needs {len(default)} numbers, not {described(value) if count is None else count}.")
    return tuple(_plain_number(label, component, False, details) for component in value)


def _length(value):
    """Return the length of a sequence other than text; None for other values."""
    if not hasattr(value, "__len__") or isinstance(value, str | bytes | Mapping | Set):
        return None
    if isinstance(value, np.ndarray) and value.ndim == 0:  # its `__len__` raises
        return None
    return len(value)


def _plain_text(label, value, details):
    if not isinstance(value, str):
        raise HairError(f"{label} must be text, not {described(value)}.")
    allowed = [choice[0] for choice in details.choices]
    if allowed and value not in allowed:
        raise HairError(f"{label} must be one of {', '.join(allowed)}, not {described(value)}.")
    # Blender truncates text at a null character, and rejects lone surrogates.
    if "\0" in value or not is_text(value):
        raise HairError(f"{label} has a character that is not allowed: {value[:40]!a}.")
    return str(value)


def _plain_number(label, value, is_whole, details):
    kind = "whole number" if is_whole else "number"
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        raise HairError(f"{label} must be a {kind}, not {described(value)}.")
    number = _as_float(value)
    if is_whole and not number.is_integer() and abs(number) != math.inf:
        raise HairError(f"{label} must be a whole number, not {number:g}.")
    # NaN fails as well: every comparison with NaN is false.
    if not (math.isfinite(number) and details.low <= number <= details.high and number > details.above):
        raise HairError(f"{label} must be {_range(details)}, not {number:g}.")
    return round(value) if is_whole else number


def _as_float(number):
    """Return a real number as a float; infinity if it is too large."""
    try:
        return float(number)
    except OverflowError:
        return math.inf if number > 0 else -math.inf


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
