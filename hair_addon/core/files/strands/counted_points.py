# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands that each begin with their number of points: HairSalon's .data [Hu15] and CT2Hair's .bin [Shen23].

    int32 strands; for each strand: int32 points, and for each point
        .data   float32 x, y, z
        .bin    float32 x, y, z, direction (3), label (1)

Little-endian, from root to tip, without widths. No source states the units and axes: HairSalon's head is in meters with
Y up, CT2Hair's scans are in millimeters with Z up. A .bin file of x, y, z alone, as some programs write, is read too.
"""

from pathlib import Path
from typing import NoReturn

import numpy as np

from ..curve_file import Convention, CurveFile
from ..flat_curves import curve_sets
from . import contents
from .contents import Damaged

DATA_USUAL = Convention(1.0, "Y")
BIN_USUAL = Convention(0.001, "Z")

_DATA_WIDTH, _BIN_WIDTH = 3, 7  # numbers of a point


def read_data(path: Path) -> CurveFile:
    """Return the strands of a .data file. Raises `HairError`."""
    with contents.bytes_of(path) as data:
        values, counts, _end = _parsed(data, _DATA_WIDTH)
        return CurveFile(curve_sets(path.stem, values, counts), usual=DATA_USUAL)


def read_bin(path: Path) -> CurveFile:
    """Return the strands of a .bin file. Raises `HairError`."""
    with contents.bytes_of(path) as data:
        values, counts = _whole(data, _BIN_WIDTH) or _whole(data, _DATA_WIDTH) or _refuse()
        return CurveFile(curve_sets(path.stem, values[:, :3], counts), usual=BIN_USUAL)


def _whole(data, width):
    """Return points and counts like `_parsed`; None unless the strands end with the file."""
    try:
        values, counts, end = _parsed(data, width)
    except Damaged:
        return None
    return (values, counts) if end == len(data) else None


def _refuse() -> NoReturn:
    raise Damaged("its strands do not end with the file")


def _parsed(data, width):
    """Return (N, width) float32 numbers of all points, (S,) int64 counts, and the byte after the last strand."""
    words = np.frombuffer(data, "<i4", len(data) // 4)
    strand_count = int(words[0]) if len(words) else -1
    if not 0 <= strand_count < len(words):
        raise Damaged("it is not a file of strands")
    view, places, place = memoryview(words), np.empty(strand_count, np.int64), 1
    for strand in range(strand_count):
        if place >= len(words) or view[place] < 0:
            raise Damaged("it ends before its last strand")
        places[strand] = place
        place += 1 + view[place] * width
    if place > len(words):
        raise Damaged("it ends before its last strand")
    is_value = np.ones(place, bool)
    is_value[0] = False
    is_value[places] = False
    values = words[:place][is_value].view("<f4").reshape(-1, width)
    return values, words[places].astype(np.int64), 4 * place
