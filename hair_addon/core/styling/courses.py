# SPDX-License-Identifier: GPL-3.0-or-later
"""Courses: curves from root to tip that multiply numbers of styles, such as the radius of curls.

A course has `SAMPLES` values at even fractions of a strand's length, and is linear between them. Each kind of step
lists the settings that may have a course in `COURSES`, the amount first; its .strand file reads them by their places
in this list.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..errors import HairError
from ..params import declared
from .base import StyleSettings

SAMPLES = 64
MOST_OF_A_STEP = 4  # courses that a step may have
BITS = 7  # of the row of each course, packed into one integer

# Samples (N,) by (index of the style, name of its setting).
Courses = Mapping[tuple[int, str], np.ndarray]


def settings_with_course(settings: StyleSettings | type[StyleSettings]) -> tuple[str, ...]:
    """Return the names of the settings of a style that may have a course, as declared."""
    settings_class = settings if isinstance(settings, type) else type(settings)
    return tuple(name for name, _default, details in declared(settings_class) if details.has_course)


def sampled(course: np.ndarray) -> np.ndarray:
    """Return (`SAMPLES`,) float32 of a course (N,) with even samples from root to tip."""
    return at(course, np.linspace(0.0, 1.0, SAMPLES)).astype(np.float32)


def at(course: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Return the values of a course (N,) at fractions x of the length, in the shape of x."""
    return np.interp(x, np.linspace(0.0, 1.0, len(course)), course)


def are_same(one: np.ndarray | None, other: np.ndarray | None) -> bool:
    """Return whether two courses are the same; None is no course."""
    if one is None or other is None:
        return one is other
    return np.array_equal(one, other)


class Table:
    """The distinct courses of a program, in rows."""

    def __init__(self) -> None:
        self._places: dict[bytes, int] = {}
        self._rows: list[np.ndarray] = []

    def packed(self, courses: Courses, place: int, names: tuple[str, ...]) -> int:
        """Return the rows of a step's courses, packed with `BITS` bits each. Rows count from one; 0 is no course.

        place: index of the step's style; names: of the settings that may have a course. Raises `HairError`.
        """
        found = 0
        for slot, name in enumerate(names):
            course = courses.get((place, name))
            if course is not None:
                samples = sampled(course)
                row = self._places.setdefault(samples.tobytes(), len(self._rows))
                if row == len(self._rows):
                    self._rows.append(samples)
                found |= (row + 1) << (BITS * slot)
        if len(self._rows) >= 1 << BITS:
            raise HairError("The styles of a hair system can have at most {most} curves.", most=(1 << BITS) - 1)
        return found

    def rows(self) -> np.ndarray:
        """Return (C, `SAMPLES`) float32."""
        return np.array(self._rows, np.float32).reshape(-1, SAMPLES)


def names_of(module: Any) -> tuple[str, ...]:
    """Return the settings of a kind of step that may have a course, in the order of its text; module: of the step."""
    return getattr(module, "COURSES", ())
