# SPDX-License-Identifier: GPL-3.0-or-later
"""A plot of ratios: a line for each comparison, a dot for each color channel, the aim as a band."""

import numpy as np

from blend_samples.sheets import picture_files

_LOW, _HIGH = 0.75, 1.25
_BAND = (0.9, 1.1)
_LEFT, _WIDTH, _RIGHT, _LINE, _TOP, _BOTTOM = 150, 600, 24, 24, 40, 40
_DOT = 5
_CHANNELS = np.array([[235, 80, 70], [80, 200, 95], [95, 140, 255]])


def write(ratios, path):
    """{(hair, light): (3,) ratios} → a PNG."""
    height = _TOP + _LINE * len(ratios) + _BOTTOM
    pixels = np.full((height, _LEFT + _WIDTH + _RIGHT, 3), 24, np.uint8)
    inside = slice(_TOP, height - _BOTTOM)
    pixels[inside, _column(_BAND[0]) : _column(_BAND[1])] = 44
    words = []
    for value in np.arange(0.8, 1.21, 0.1):
        pixels[inside, _column(value)] = 90 if abs(value - 1.0) > 0.01 else 200
        words.append((f"{value:.1f}", _column(value) - 10, height - _BOTTOM + 22))
    for line, ((hair, light), values) in enumerate(ratios.items()):
        middle = _TOP + _LINE * line + _LINE // 2
        words.append((f"{hair}, {light}", 12, middle + 5))
        for value, color in zip(np.clip(values, _LOW, _HIGH), _CHANNELS, strict=True):
            column = _column(value)
            pixels[middle - _DOT : middle + _DOT, column - _DOT // 2 : column + _DOT // 2 + 1] = color
    words.append(("mean colour of the hair: Vellus / Cycles", _LEFT, _TOP - 14))
    picture_files.write(pixels, path, words)


def _column(ratio):
    return _LEFT + round(_WIDTH * (ratio - _LOW) / (_HIGH - _LOW))
