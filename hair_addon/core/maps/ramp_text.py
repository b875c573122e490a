# SPDX-License-Identifier: GPL-3.0-or-later
"""Ramps as text for settings files, scripts and the command line: "0:1 0.5:0.3 1:0.2".

A point of a curve is POSITION:VALUE, both from 0 to 1, with lines between points; POSITION:VALUE:auto rounds the curve
at the point. A stop of a color ramp is POSITION:RED/GREEN/BLUE, scene-linear, with /ALPHA if it is not 1. Words before
the first point change the interpolation.
"""

import math
from dataclasses import dataclass

from ..errors import HairError

HANDLES = ("vector", "auto", "auto_clamped")  # handles of points of curves; the first is the default
EXTENDS = ("horizontal", "extrapolated")  # of curves beyond their first and last points
# Of color ramps: interpolation of colors, color space, and direction of hues.
INTERPOLATIONS = ("linear", "ease", "b_spline", "cardinal", "constant")
MODES = ("rgb", "hsv", "hsl")
HUES = ("near", "far", "cw", "ccw")

MOST_STOPS = 32  # of Blender's color ramps
_MOST_POINTS = 1024  # of curves: more than the samples that are read


@dataclass(frozen=True)
class Curve:
    """Points (position, value, handle) of a curve in the order of their positions."""

    points: tuple[tuple[float, float, str], ...]
    extend: str = EXTENDS[0]

    def text(self) -> str:
        """Return the curve as text."""
        words = [self.extend] if self.extend != EXTENDS[0] else []
        for position, value, handle in self.points:
            words.append(":".join([_written(position), _written(value), *([handle] if handle != HANDLES[0] else [])]))
        return " ".join(words)


@dataclass(frozen=True)
class Colors:
    """Stops (position, (red, green, blue, alpha)) of a color ramp in the order of their positions."""

    stops: tuple[tuple[float, tuple[float, float, float, float]], ...]
    interpolation: str = INTERPOLATIONS[0]
    mode: str = MODES[0]
    hue: str = HUES[0]

    def text(self) -> str:
        """Return the color ramp as text."""
        pairs = (self.interpolation, INTERPOLATIONS), (self.mode, MODES), (self.hue, HUES)
        words = [word for word, known in pairs if word != known[0]]
        for position, color in self.stops:
            shown = color if color[3] != 1.0 else color[:3]
            words.append(f"{_written(position)}:" + "/".join(map(_written, shown)))
        return " ".join(words)


def parsed(text: str) -> Curve | Colors | None:
    """Return the ramp of a text; None for an empty text. Raises `HairError`."""
    words = text.split()
    if not words:
        return None
    points = [word for word in words if ":" in word]
    options = [word.lower() for word in words[: len(words) - len(points)]]
    if not points or any(":" not in word for word in words[len(options) :]):
        raise _invalid(text)
    return _colors(options, points, text) if any("/" in word for word in points) else _curve(options, points, text)


def _written(number):
    short = f"{number:g}"
    return short if float(short) == number else repr(number)


def require_curve(text: str) -> None:
    """Raise `HairError` unless a text is empty or describes a curve."""
    if isinstance(parsed(text), Colors):
        raise HairError('"{ramp}" is a color ramp: write a curve, such as 0:1 0.5:0.3 1:0.2.', ramp=text[:80])


def _curve(options, points, text):
    extend = _chosen(options, EXTENDS)
    if options or not 2 <= len(points) <= _MOST_POINTS:
        raise _invalid(text)
    read = []
    for word in points:
        position, value, handle = [*word.split(":"), HANDLES[0]][:3] if word.count(":") < 3 else ("", "", "")
        if handle.lower() not in HANDLES:
            raise _invalid(text)
        read.append((_part(position, text), _part(value, text), handle.lower()))
    return Curve(tuple(sorted(read)), extend)


def _colors(options, points, text):
    chosen = [_chosen(options, known) for known in (INTERPOLATIONS, MODES, HUES)]
    if options or len(points) > MOST_STOPS:
        raise _invalid(text)
    read = []
    for word in points:
        position, _, color = word.partition(":")
        parts = [_part(part, text) for part in color.split("/")]
        if len(parts) not in (3, 4):
            raise _invalid(text)
        red, green, blue, alpha = [*parts, 1.0][:4]
        read.append((_part(position, text), (red, green, blue, alpha)))
    return Colors(tuple(sorted(read)), *chosen)


def _chosen(options, known):
    """Remove the known word from options and return this word; without a known word, return the default."""
    found = next((word for word in options if word in known), None)
    if found is not None:
        options.remove(found)
    return found or known[0]


def _part(text, whole):
    try:
        number = float(text)
    except ValueError:
        raise _invalid(whole) from None
    if not (math.isfinite(number) and 0.0 <= number <= 1.0):
        raise _invalid(whole)
    return number


def _invalid(text):
    sentence = '"{ramp}" is not a ramp: write points from 0 to 1, such as 0:1 0.5:0.3 1:0.2 or 0:0/0/0 1:1/0.8/0.5.'
    return HairError(sentence, ramp=text[:80])
