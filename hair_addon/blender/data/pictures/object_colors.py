# SPDX-License-Identifier: GPL-3.0-or-later
"""Colors of objects by a viewport's color type: Single, Object or Random."""

import colorsys

_SATURATION, _VALUE = 0.5, 0.8  # of random colors
_MASK = 0xFFFFFFFF


def color_of(shown_object, color):
    """Return (3,) scene-linear color of an object by a `viewport_shading.HairColor`."""
    if color.kind == "SINGLE":
        return color.color
    if color.kind == "OBJECT":
        return tuple(map(float, shown_object.color[:3]))
    return random_color(shown_object.name, shown_object.library and shown_object.library.filepath)


def random_color(name, library=None):
    """Return (3,) scene-linear color that Blender gives an object of this name; library: path of its file if it is
    linked.
    """
    number = _murmur(b"OB" + name.encode() + b"\0")
    if library:
        number = ((number * 13) & _MASK) ^ _murmur(library.encode() + b"\0")
    hue = _mixed(number) / _MASK
    return colorsys.hsv_to_rgb(hue, _SATURATION, _VALUE)


def _murmur(data):
    """MurmurHash2 [Appleby08], 32 bits, seed 0."""
    factor, state, whole = 0x5BD1E995, len(data), len(data) // 4 * 4
    for start in range(0, whole, 4):
        word = int.from_bytes(data[start : start + 4], "little") * factor & _MASK
        word = (word ^ word >> 24) * factor & _MASK
        state = (state * factor & _MASK) ^ word
    rest = data[whole:]
    if rest:
        state = (state ^ int.from_bytes(rest, "little")) * factor & _MASK
    state = (state ^ state >> 13) * factor & _MASK
    return state ^ state >> 15


def _mixed(number):
    """Return the last mixing of lookup3 [Jenkins06] for a number and zero."""
    start = (0xDEADBEEF + (2 << 2) + 13) & _MASK
    a, b, c = (start + number) & _MASK, start, start
    c = ((c ^ b) - _turned(b, 14)) & _MASK
    a = ((a ^ c) - _turned(c, 11)) & _MASK
    b = ((b ^ a) - _turned(a, 25)) & _MASK
    c = ((c ^ b) - _turned(b, 16)) & _MASK
    a = ((a ^ c) - _turned(c, 4)) & _MASK
    b = ((b ^ a) - _turned(a, 14)) & _MASK
    return ((c ^ b) - _turned(b, 24)) & _MASK


def _turned(number, bits):
    return (number << bits | number >> (32 - bits)) & _MASK
