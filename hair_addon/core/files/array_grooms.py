# SPDX-License-Identifier: GPL-3.0-or-later
"""Grooms as arrays in an .npz file, for scripts.

    roots (S, 3), strand_points (S, P, 3), guide_points (G, P, 3)   [m], in the axes of the mesh's file
    strand_widths (S, P), guide_widths (G, P)                       diameters [m]
    up                                                              the axis that points up, X, Y or Z

A file of guide_points alone is one too: widths and axis are optional.
"""

import math
import zipfile
from pathlib import Path

import numpy as np

from ..errors import HairError, cause_of
from .curve_file import TO_Z_UP, Convention, CurveFile, CurveSet

_POINTS = {"guide_points": True, "strand_points": False}
_NAMES = {"guide_points": "Guides", "strand_points": "Hair"}


def read(path: Path, axis: str = "Z") -> CurveFile:
    """The curves of a file of arrays; axis: that points up in one that does not say. Raises `HairError`."""
    try:
        with open(path, "rb") as file, zipfile.ZipFile(file) as archive:
            return _read(path, archive, axis)
    except (OSError, RuntimeError, ValueError, EOFError, MemoryError, NotImplementedError, zipfile.BadZipFile) as error:
        raise HairError("{path} cannot be read: {cause}.", path=path, cause=cause_of(error)) from error


def _read(path, archive, axis):
    there = {name.removesuffix(".npy") for name in archive.namelist()}
    names = [name for name in _POINTS if name in there]
    if not names:
        raise HairError(
            "{path} has no curves: an .npz file needs an array guide_points or strand_points, (G, P, 3).", path=path
        )
    sets = []
    for name in names:
        points = _array(archive, name)
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
            widths = _array(archive, width_name)
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
        axis = str(_array(archive, "up"))
        if axis not in TO_Z_UP:
            raise HairError("{path}: up is {axis}, but must be X, Y or Z.", path=path, axis=axis[:20])
    return CurveFile(sets, Convention(1.0, axis))


def _array(archive, name):
    """An array of a file, which is as large as the file says, so that no more memory is taken."""
    member = archive.getinfo(f"{name}.npy")
    with archive.open(member) as file:
        version = np.lib.format.read_magic(file)
        read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, _is_fortran, kind = read(file)
    if math.prod(shape) * kind.itemsize > member.file_size:
        raise ValueError("it is damaged")
    with archive.open(member) as file:
        return np.lib.format.read_array(file)  # no objects, which could be code
