# SPDX-License-Identifier: GPL-3.0-or-later
"""Grooms as arrays in an .npz file, for scripts.

    roots (S, 3), strand_points (S, P, 3), guide_points (G, P, 3)   [m], in the axes of the mesh's file
    strand_widths (S, P), guide_widths (G, P)                       diameters [m]
    up                                                              the axis that points up, X, Y or Z

A file of guide_points alone is one too: widths and axis are optional.
"""

from pathlib import Path

import numpy as np

from ..errors import HairError
from . import foreign_arrays
from .curve_file import TO_Z_UP, Convention, CurveFile, CurveSet

_POINTS = {"guide_points": True, "strand_points": False}
_NAMES = {"guide_points": "Guides", "strand_points": "Hair"}


def read(path: Path, axis: str = "Z") -> CurveFile:
    """The curves of a file of arrays; axis: that points up in one that does not say. Raises `HairError`."""
    with foreign_arrays.opened(path) as archive:
        return _read(path, archive, axis)


def _read(path, archive, axis):
    there = {*foreign_arrays.names(archive)}
    names = [name for name in _POINTS if name in there]
    if not names:
        raise HairError(
            "{path} has no curves: an .npz file needs an array guide_points or strand_points, (G, P, 3).", path=path
        )
    sets = []
    for name in names:
        points = foreign_arrays.array(archive, name)
        if (
            points.ndim != 3
            or points.shape[2] != 3
            or len(points) < 1
            or points.shape[1] < 2
            or points.dtype.kind != "f"
        ):
            sentence = "{path}: {name} has shape {shape}, but must be (G, P, 3), P at least 2."
            raise HairError(sentence, path=path, name=name, shape=points.shape)
        count, length, _ = points.shape
        width_name = name.replace("points", "widths")
        radii = None
        if width_name in there:
            widths = foreign_arrays.array(archive, width_name)
            if widths.shape != (count, length) or widths.dtype.kind != "f":
                sentence = "{path}: {name} has shape {shape}, but must be {wanted}, as points have."
                raise HairError(sentence, path=path, name=width_name, shape=widths.shape, wanted=(count, length))
            radii = widths.ravel() / np.asarray(2.0, widths.dtype)
        sets.append(
            CurveSet(
                _NAMES[name],
                points.reshape(-1, 3),
                np.full(count, length),
                np.zeros(count, bool),
                radii,
                is_guide=_POINTS[name] if len(names) > 1 else None,
            )
        )
    if "up" in there:
        axis = str(foreign_arrays.array(archive, "up"))
        if axis not in TO_Z_UP:
            raise HairError("{path}: up is {axis}, but must be X, Y or Z.", path=path, axis=axis[:20])
    return CurveFile(sets, Convention(1.0, axis))
