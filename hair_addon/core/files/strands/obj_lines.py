# SPDX-License-Identifier: GPL-3.0-or-later
"""Lines of Wavefront OBJ files [Wavefront95] as strands: v x y z, and l with the numbers of a line's points.

A number may be followed by a texture vertex, as in 7/3; negative numbers are counted back from the last point. Lines of
two points that share ends, as Blender writes edges, are joined. o and g begin objects. Faces and free-form curves are
left out. The format states no unit and no axis; programs write Y up by default.
"""

from pathlib import Path

import numpy as np

from ..curve_file import Convention, CurveFile
from ..flat_curves import curve_sets
from . import chains, contents
from .contents import Damaged

_USUAL = Convention(1.0, "Y")


def read(path: Path) -> CurveFile:
    """Return the lines of an .obj file. Raises `HairError`."""
    with contents.bytes_of(path) as data:
        points, objects = _statements(data)
        if not objects:
            raise Damaged("it has no lines (l)")
        sets = []
        for name, lines in objects.items():
            indices, counts = _joined(lines, len(points))
            sets += curve_sets(name or path.stem, points[indices], counts)
        return CurveFile(sets, usual=_USUAL)


def _statements(data):
    """Return (points (V, 3) float32, {object: [indices of a line]})."""
    points: list[list[float]] = []
    objects: dict[str, list[list[int]]] = {}
    name = ""
    for line in data.replace(b"\\\r\n", b" ").replace(b"\\\n", b" ").splitlines():
        kind, *words = line.split() or [b""]
        try:
            if kind == b"v":
                points.append([float(word) for word in words[:3]])
                if len(words) < 3:
                    raise ValueError
            elif kind == b"l":
                numbers = [int(word.partition(b"/")[0]) for word in words]
                line_points = [number - 1 if number > 0 else len(points) + number for number in numbers]
                objects.setdefault(name, []).append(line_points)
            elif kind in (b"o", b"g"):
                name = b" ".join(words).decode("utf-8", "replace")[:60]
        except ValueError as error:
            raise Damaged("a line of it is damaged") from error
    return np.array(points, np.float64).reshape(-1, 3).astype(np.float32), objects


def _joined(lines, point_count):
    """Return (indices (N,), counts (C,)) of an object's lines, with edges joined."""
    indices = np.array([index for line in lines for index in line], object)
    if any(not 0 <= index < point_count for index in indices):
        raise Damaged("its lines use points that it does not have")
    counts = np.array([len(line) for line in lines], np.int64)
    indices = indices.astype(np.int64)
    if len(counts) and (counts == 2).all():
        return chains.polylines(indices.reshape(-1, 2), point_count)
    return indices, counts
