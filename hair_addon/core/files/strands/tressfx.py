# SPDX-License-Identifier: GPL-3.0-or-later
"""TressFX 4 files [AMD17]: guides with equal numbers of points, little-endian, a header of 160 bytes.

    0    float32   version, 4
    4    uint32    strands S
    8    uint32    points of each strand P
    12   uint32    offsets of arrays, in bytes, 0 for none: positions (S, P, 4) float32, root UVs (S, 2), UVs of points
                   (S, P, 2), thickness (S,), colors (S, P, 4)
    32   128 bytes reserved

The fourth number of a position is 0 where a point is fixed. Thickness is a factor of the renderer's fiber radius, which
the file does not state, so no widths are read. No source states unit and axis: the exporter from Maya writes Maya's,
centimeters with Y up.
"""

import struct
from pathlib import Path

import numpy as np

from ..curve_file import Convention, CurveFile
from ..flat_curves import curve_sets
from . import contents
from .contents import Damaged

_HEADER = struct.Struct("<f7I128x")
_USUAL = Convention(0.01, "Y")


def read(path: Path) -> CurveFile:
    """Return the strands of a binary .tfx file. Raises `HairError`."""
    with contents.bytes_of(path) as data:
        return _read(data, path.stem)


def _read(data, name):
    version = struct.unpack_from("<f", data)[0] if len(data) >= _HEADER.size else 0.0
    if not 4.0 <= version < 6.0:
        raise Damaged("it is not a binary file of TressFX 4")
    _version, strand_count, point_count, positions, root_uvs, *_others = _HEADER.unpack_from(data)
    if not positions or point_count < 2:
        raise Damaged("it has no strands")
    points = contents.array(data, "<f4", 4 * strand_count * point_count, positions).reshape(-1, 4)
    uvs = contents.array(data, "<f4", 2 * strand_count, root_uvs).reshape(-1, 2) if root_uvs else None
    counts = np.full(strand_count, point_count, np.int64)
    return CurveFile(curve_sets(name, points[:, :3], counts, root_uvs=uvs), usual=_USUAL)
