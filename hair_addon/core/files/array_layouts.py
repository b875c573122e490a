# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands in .npz files [Kern07] of other programs, recognized by the shapes of their arrays.

    positions   (S, P, 3), or (N, 3) with the counts or the offsets of the strands
    counts      (S,) integers with sum N; offsets (S + 1,), ascending from 0 to N, or (S,) without the last entry
    widths      diameters (width, thickness, diameter) or radii (radius): (S, P), (N,), (S,) or one number

The array with a fitting shape holds the positions. If several arrays fit, the array whose name is in `_POINTS` holds
the positions. Names are compared without case. Numbers may have 16, 32 or 64 bits.
"""

import zipfile
from pathlib import Path

import numpy as np

from ..errors import HairError
from . import untrusted_arrays
from .curve_file import CurveSet
from .flat_curves import curve_sets

_POINTS = ("strands", "points", "positions", "position", "point", "hair", "strand", "vertices", "verts", "pos", "p")
_RADII = ("radii", "radius")
_DIAMETERS = ("widths", "width", "thickness", "thicknesses", "diameters", "diameter")
_IDS = ("ids", "id", "strand_ids")
_UVS = ("root_uvs", "root_uv", "uvs", "uv", "roots_uv")


def read(path: Path, archive: zipfile.ZipFile) -> list[CurveSet]:
    """Return the strands of an archive. Raises `HairError`."""
    headers = {name: untrusted_arrays.header(archive, name) for name in untrusted_arrays.names(archive)}
    whole = [name for name, (shape, kind) in headers.items() if kind.kind == "f" and _is_whole(shape)]
    flat = [name for name, (shape, kind) in headers.items() if kind.kind == "f" and _is_flat(shape)]
    counts_of = {}
    for name in flat:
        ragged = _ragged(archive, headers, headers[name][0][0])
        if ragged is not None:
            counts_of[name] = ragged
    name = _chosen(path, whole or [*counts_of])
    points = untrusted_arrays.array(archive, name)
    counts = np.full(points.shape[0], points.shape[1]) if whole else counts_of[name]
    found = {one.lower(): one for one in headers}
    radii = _radii(archive, found, counts)
    ids, uvs = (_of_curves(archive, found, names, len(counts)) for names in (_IDS, _UVS))
    if ids is not None and (ids.ndim != 1 or ids.dtype.kind not in "iu"):
        ids = None
    if uvs is not None and (uvs.ndim != 2 or uvs.shape[1] != 2 or uvs.dtype.kind != "f"):
        uvs = None
    return curve_sets(
        path.stem,
        _wide(points.reshape(-1, 3)),
        counts,
        radii=radii,
        ids=None if ids is None else ids.astype(np.int32),
        root_uvs=None if uvs is None else uvs.astype(np.float32),
    )


def _is_whole(shape):
    return len(shape) == 3 and shape[0] >= 1 and shape[1] >= 2 and shape[2] == 3


def _is_flat(shape):
    return len(shape) == 2 and shape[0] >= 2 and shape[1] == 3


def _wide(values):
    """Return numbers of 16 bits as float32, others unchanged."""
    return values.astype(np.float32) if values.dtype.itemsize < 4 else values


def _chosen(path, names):
    if len(names) == 1:
        return names[0]
    known = [name for one in _POINTS for name in names if name.lower() == one]
    if known:
        return known[0]
    if names:
        sentence = "{path} has several arrays that may be strands ({names}): name one of them strands."
        raise HairError(sentence, path=path, names=", ".join(names[:5]))
    sentence = "{path} has no curves: an .npz file needs an array (S, P, 3), or (N, 3) with the points of each strand."
    raise HairError(sentence, path=path)


def _ragged(archive, headers, point_count):
    """Return the number of points (S,) int64 of each strand from counts or offsets that fit; None without these."""
    for name, (shape, kind) in headers.items():
        if kind.kind not in "iu" or len(shape) != 1 or not 1 <= shape[0] <= point_count + 1:
            continue
        values = untrusted_arrays.array(archive, name)
        if values.min() < 0 or values.max() > point_count:
            continue
        values = values.astype(np.int64)
        if values.min() >= 1 and values.sum() == point_count:
            return values
        if values[0] == 0 and (np.diff(values) >= 1).all() and len(values) > 1:
            return np.diff(values if values[-1] == point_count else np.append(values, point_count))
    return None


def _radii(archive, found, counts):
    """Return the radii (N,) float32 of all points; None if no array fits."""
    for names, factor in ((_RADII, 1.0), (_DIAMETERS, 0.5)):
        for name in names:
            if name not in found:
                continue
            values = untrusted_arrays.array(archive, found[name])
            if values.dtype.kind != "f":
                continue
            values = (values.astype(np.float64) * factor).astype(np.float32)
            total = int(counts.sum())
            if values.size == total:
                return values.reshape(-1)
            if values.size == len(counts):
                return np.repeat(values.reshape(-1), counts)
            if values.size == 1:
                return np.full(total, values.reshape(-1)[0])
    return None


def _of_curves(archive, found, names, curve_count):
    for name in names:
        if name in found:
            values = untrusted_arrays.array(archive, found[name])
            if values.ndim and len(values) == curve_count:
                return values
    return None
