# SPDX-License-Identifier: GPL-3.0-or-later
"""HAIR files [Yuksel10]: a header of 128 bytes, then arrays, little-endian.

    0    4 bytes   HAIR
    4    uint32    strands S
    8    uint32    points N
    12   uint32    arrays of the file, in this order: 1 segments, 2 points, 4 thickness, 8 transparency, 16 colors
    16   uint32    segments of each strand, if segments are missing
    20   float32   thickness, if thickness is missing
    24   float32   transparency; 28: color, 3 float32; 40: text, 88 bytes

    segments (S,) uint16; points (N, 3) float32, from root to tip; thickness (N,); transparency (N,); colors (N, 3)

The specification does not define thickness further: it is read and written as a diameter. A default thickness of 1 is
ignored: the format's library writes it to files without thickness. The specification states no unit and no axis.
"""

import struct
from pathlib import Path

import numpy as np

from ..curve_file import Convention, CurveFile
from ..flat_curves import curve_sets
from . import contents
from .contents import Damaged

HEADER = struct.Struct("<4s4I5f88s")
MAGIC = b"HAIR"
SEGMENTS, POINTS, THICKNESS, TRANSPARENCY, COLORS = 1, 2, 4, 8, 16
OURS = b"Vellus: meters, Z up, thickness is the diameter"

_USUAL = Convention(0.01, "Z")
_NO_THICKNESS = 1.0


def read(path: Path) -> CurveFile:
    """Return the strands of a HAIR file. Raises `HairError`."""
    with contents.bytes_of(path) as data:
        return _read(data, path.stem)


def _read(data, name):
    if len(data) < HEADER.size or data[:4] != MAGIC:
        raise Damaged("it is not a HAIR file")
    _magic, strand_count, point_count, arrays, segments, thickness, *_color, text = HEADER.unpack_from(data)
    if not arrays & POINTS:
        raise Damaged("it has no points")
    place = HEADER.size
    if not arrays & SEGMENTS and strand_count * (segments + 1) != point_count:
        raise Damaged("its strands do not have the number of its points")
    stored = contents.array(data, "<u2", strand_count if arrays & SEGMENTS else 0, place)
    place += stored.nbytes
    points = contents.array(data, "<f4", 3 * point_count, place).reshape(-1, 3)
    place += 12 * point_count
    counts = stored.astype(np.int64) + 1 if arrays & SEGMENTS else np.full(strand_count, segments + 1, np.int64)
    if counts.sum() != point_count:
        raise Damaged("its strands do not have the number of its points")
    radii = None
    if arrays & THICKNESS:
        radii = contents.array(data, "<f4", point_count, place) / np.float32(2.0)
    elif 0.0 < thickness < np.inf and thickness != _NO_THICKNESS:
        radii = np.full(point_count, thickness / 2.0, np.float32)
    stated = Convention(1.0, "Z") if text.startswith(OURS) else Convention()
    return CurveFile(curve_sets(name, points, counts, radii=radii), stated, _USUAL)
