# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers of guides and strands from their density: hairs per square centimeter where the mask is full.

A density is kept when the surface, its scale or its mask changes. Zero stands for no density: the number is set itself.
"""

from dataclasses import replace
from typing import Any, TypeVar

from ..errors import HairError
from ..params import Settings, declared

S = TypeVar("S", bound=Settings)

COUNTS = {"guide_density": "guide_count", "strand_density": "strand_count"}  # {density: the number that it sets}

_SQUARE_CENTIMETERS = 1e4  # in a square meter


def name_of(settings: Any) -> str:
    """Return the name of the density in `GuideSettings`, `HairSettings`, or properties of the same names."""
    return next(name for name in COUNTS if hasattr(settings, name))


def is_set(settings: Any) -> bool:
    """Whether settings, as in `name_of`, have a density that sets their number."""
    return getattr(settings, name_of(settings)) > 0.0


def counted(settings: S, area: float) -> S:
    """Return `GuideSettings` or `HairSettings` with the number for their density; unchanged without one.

    area: that hair grows on [m²], of `groom_defaults.grown_area`. A number within one of density × area is kept, so
    that rounding of a turned surface places no root anew. Raises `HairError` for more than the largest number.
    """
    density = name_of(settings)
    if not is_set(settings):
        return settings
    count = COUNTS[density]
    wanted = getattr(settings, density) * area * _SQUARE_CENTIMETERS
    most = next(details.high for name, _default, details in declared(type(settings)) if name == count)
    if not wanted <= most:
        sentence = "The density needs {count} guides, more than {most}: decrease Guide Density."
        if count == "strand_count":
            sentence = "The density needs {count} strands, more than {most}: decrease Strand Density."
        raise HairError(sentence, count=f"{wanted:.0f}", most=f"{most:.0f}")
    if abs(getattr(settings, count) - wanted) < 1.0:
        return settings
    return replace(settings, **{count: max(round(wanted), 1)})


def of_count(count: int, area: float) -> float:
    """Return the density [cm⁻²] of a number on an area [m²]. Raises `HairError` for no area."""
    if not area > 0.0:
        raise HairError("The density is zero on every face: paint weight where hair should grow.")
    return count / (area * _SQUARE_CENTIMETERS)
