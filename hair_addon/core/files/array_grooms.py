# SPDX-License-Identifier: GPL-3.0-or-later
"""Grooms as arrays in an .npz file, for scripts.

    roots (S, 3), strand_points (S, P, 3), guide_points (G, P, 3)   [m], in the axes of the mesh's file
    strand_widths (S, P), guide_widths (G, P)                       diameters [m]
    strand_counts (S,), guide_counts (G,)                           number of points of each curve, see below
    up                                                              the up axis: X, Y or Z

    Exported files also have, with the prefix strand_ or guide_: ids (S,); root_uvs (S, 2); groups (S,), indices into
    group_names (K,); and of strands only: strand_guide_ids and strand_guide_weights (S, 3); strand_colors (S, P, 3),
    linear RGB; strand_roughness (S, P); strand_radial_roughness (S,) if a map varies it

Only one of strand_points and guide_points is required. If curves have different numbers of points, the points of all
curves are concatenated, (N, 3), with widths (N,), and the counts have the number of points of each curve.
"""

from pathlib import Path

import numpy as np

from ..errors import HairError
from . import array_layouts, untrusted_arrays
from .curve_file import TO_Z_UP, Convention, CurveFile, CurveSet
from .flat_curves import curve_sets

_POINTS = {"guide_points": True, "strand_points": False}
_NAMES = {"guide_points": "Guides", "strand_points": "Hair"}


def read(path: Path, axis: str = "Z") -> CurveFile:
    """Return the curves of a file of arrays; axis: the up axis if the file has none. Raises `HairError`."""
    with untrusted_arrays.opened(path) as archive:
        return _read(path, archive, axis)


def _read(path, archive, axis):
    there = {*untrusted_arrays.names(archive)}
    names = [name for name in _POINTS if name in there]
    if not names:
        return CurveFile(array_layouts.read(path, archive), usual=Convention(1.0, axis))
    sets: list[CurveSet] = []
    for name in names:
        points, counts = untrusted_arrays.array(archive, name), _counts(path, archive, there, name)
        shape = points.shape
        is_fitting = len(shape) == 3 and shape[1] >= 2 if counts is None else len(shape) == 2
        if not is_fitting or shape[0] < 1 or shape[-1] != 3 or points.dtype.kind != "f":
            sentence = "{path}: {name} has shape {shape}, but must be (G, P, 3), P at least 2, or (N, 3) with {counts}."
            raise HairError(sentence, path=path, name=name, shape=shape, counts=_counts_of(name))
        if counts is None:
            counts = np.full(*shape[:2])
        elif counts.min() < 2 or counts.sum() != len(points):
            sentence = "{path}: {name} must be at least 2 for each curve, and {count} in total, the number of points."
            raise HairError(sentence, path=path, name=_counts_of(name), count=len(points))
        width_name = name.replace("points", "widths")
        radii = None
        if width_name in there:
            widths = untrusted_arrays.array(archive, width_name)
            if widths.shape != shape[:-1] or widths.dtype.kind != "f":
                sentence = "{path}: {name} has shape {shape}, but must be {wanted}, as the points."
                raise HairError(sentence, path=path, name=width_name, shape=widths.shape, wanted=shape[:-1])
            radii = widths.ravel() / np.asarray(2.0, widths.dtype)
        is_guide = np.full(len(counts), _POINTS[name]) if len(names) > 1 or "group_names" in there else None
        attributes = _attributes(archive, there, name.removesuffix("points"), len(counts))
        sets += curve_sets(
            _NAMES[name],
            points.reshape(-1, 3),
            counts,
            radii=radii,
            is_guide=is_guide,
            group_names=_group_names(archive, there),
            **attributes,
        )
    if "up" in there:
        axis = str(untrusted_arrays.array(archive, "up"))
        if axis not in TO_Z_UP:
            raise HairError("{path}: up is {axis}, but must be X, Y or Z.", path=path, axis=axis[:20])
    return CurveFile(sets, Convention(1.0, axis))


# Attributes of curves: name of an array → (argument of `curve_sets`, shape of a curve's value, type).
_ATTRIBUTES = {
    "ids": ("ids", (), np.int32),
    "groups": ("group_ids", (), np.int32),
    "root_uvs": ("root_uvs", (2,), np.float32),
    "guide_ids": ("guide_ids", (3,), np.int32),
    "guide_weights": ("guide_weights", (3,), np.float32),
}


def _attributes(archive, there, prefix, curve_count):
    """Return {argument of `curve_sets`: array} of the attributes whose shape fits."""
    found = {}
    for name, (argument, width, kind) in _ATTRIBUTES.items():
        if prefix + name in there:
            values = untrusted_arrays.array(archive, prefix + name)
            if values.shape == (curve_count, *width) and values.dtype.kind == np.dtype(kind).kind:
                found[argument] = values.astype(kind)
    return found


def _group_names(archive, there):
    """Return {ID: name} of the groups."""
    if "group_names" not in there:
        return {}
    values = untrusted_arrays.array(archive, "group_names")
    if values.ndim != 1 or values.dtype.kind != "U":
        return {}
    return {number: str(name)[:60] for number, name in enumerate(values[:1000])}


def _counts_of(name):
    return name.replace("points", "counts")


def _counts(path, archive, there, name):
    """Return the number of points (G,) int64 of each curve; None if the file has no counts: all are equal."""
    if _counts_of(name) not in there:
        return None
    counts = untrusted_arrays.array(archive, _counts_of(name))
    if counts.ndim != 1 or not len(counts) or counts.dtype.kind not in "iu" or counts.max() >= 2**31:
        sentence = "{path}: {name} must have the number of points of each curve."
        raise HairError(sentence, path=path, name=_counts_of(name))
    return counts.astype(np.int64)
