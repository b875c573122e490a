# SPDX-License-Identifier: GPL-3.0-or-later
"""Fitting of settings for a human scalp to another surface: all lengths are multiplied by one factor."""

import math
from collections.abc import Collection
from dataclasses import fields, replace
from typing import Any, TypeVar

from ..params import Param
from . import base, braid, clump, wet
from .base import StyleSettings

S = TypeVar("S", bound=StyleSettings)

_FEWEST_SPACINGS = 4.0  # smaller locks have too few strands
_LOCKS: dict[type[StyleSettings], str] = {clump.Settings: "size", braid.Settings: "size", wet.Settings: "lock"}


def fitted(settings: S, factor: float, strand_spacing: float = 0.0, kept: Collection[str] = ()) -> S:
    """Return a style with its lengths multiplied by a factor; locks are at least 4 strand spacings [m] large.

    kept: names of settings that do not change.
    """
    given = {name: getattr(settings, name) for name in kept}
    if factor != 1.0:
        scaled = base.scaled(settings, factor)
        lengths = [field.name for field in fields(scaled) if field.metadata["param"].unit == "LENGTH"]
        settings = replace(scaled, **{name: _rounded(getattr(scaled, name)) for name in lengths})
    lock = _LOCKS.get(type(settings))
    if lock is not None and getattr(settings, lock) < _FEWEST_SPACINGS * strand_spacing:
        settings = replace(settings, **{lock: _rounded(_FEWEST_SPACINGS * strand_spacing)})
    return replace(settings, **given) if given else settings


def lock_size(settings: StyleSettings) -> float:
    """Return the size of a style's locks [m]; 0 for a style without locks."""
    name = _LOCKS.get(type(settings))
    return 0.0 if name is None else getattr(settings, name)


def lock_size_for(wanted: float, enlarged: float, former_count: int, count: int) -> float:
    """Return the size [m] that wanted locks need with `count` strands.

    enlarged: the size [m] that they need with `former_count` strands; the spacing of strands determines it.
    """
    return max(wanted, _rounded(enlarged * math.sqrt(former_count / max(count, 1))))


def fitted_value(value: Any, details: Param, factor: float) -> Any:
    """Return the fitted value of a setting: lengths are multiplied by a factor, within their range."""
    if details.unit != "LENGTH" or factor == 1.0:
        return value
    return _rounded(min(max(value * factor, details.low), details.high))


def _rounded(value):
    """Return a value rounded to three digits, as an artist would type it."""
    return float(f"{value:.3g}")
