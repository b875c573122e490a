# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands in PLY files: vertices, with an element that divides them into strands. No standard defines strands.

    element vertex    x, y, z; radius; or thickness, width or diameter, all of which are diameters
    element strand    nsegs: segments of the strand with the next vertices, as hairutil [Takayama23] writes; or count:
                      its points; or a list of vertices. Vellus adds id, group, guide (1 for guides), u and v of the
                      root, guide_id_0 to 2 and guide_weight_0 to 2
    element polyline, line, curve, hair, strip: with a list of vertices
    element edge      vertex1, vertex2: edges that form lines

A file of vertices without any of the other elements has no strands. The format states no unit and no axis.
"""

from pathlib import Path

import numpy as np

from ..curve_file import Convention, CurveFile
from ..flat_curves import curve_sets
from ..groom_curves import GUIDE_SLOTS
from . import chains, contents, ply_table
from .contents import Damaged

OURS = "Vellus: meters, Z up, thickness is the diameter"
GROUP = "Vellus group"  # start of a comment, before the number and the name of a group

_USUAL = Convention(1.0, "Z")
_RADII = ("radius", "radii")
_DIAMETERS = ("thickness", "width", "widths", "diameter")
_STRANDS = ("strand", "strands", "polyline", "polylines", "line", "lines", "curve", "curves", "hair", "strip")
_SEGMENTS = ("nsegs", "segments", "num_segments")
_COUNTS = ("count", "npoints", "num_points", "nverts", "num_vertices", "point_count", "vertex_count")
_EDGES = ("vertex1", "vertex2")


def read(path: Path) -> CurveFile:
    """Return the strands of a .ply file. Raises `HairError`."""
    with contents.bytes_of(path) as data:
        elements, comments = ply_table.parsed(data)
        return _read(elements, comments, path.stem)


def _read(elements, comments, name):
    vertex = elements.get("vertex")
    if vertex is None or not {"x", "y", "z"} <= vertex.values.keys():
        raise Damaged("it has no vertices")
    points = np.stack([vertex.values[axis] for axis in "xyz"], axis=1)
    points = points if points.dtype == np.dtype("f4") else points.astype(np.float64)
    radii = _radii(vertex)
    indices, counts, strand = _strands(elements, len(points))
    if indices is not None:
        points, radii = points[indices], None if radii is None else radii[indices]
    names = dict(_group(comment) for comment in comments if comment.startswith(GROUP + " "))
    attributes = {} if strand is None else _attributes(strand)
    sets = curve_sets(name, _native(points), counts, radii=radii, group_names=names, **attributes)
    return CurveFile(sets, Convention(1.0, "Z") if OURS in comments else Convention(), _USUAL)


def _native(values):
    return values.astype(values.dtype.newbyteorder("="))


def _radii(vertex):
    for names, factor in ((_RADII, 1.0), (_DIAMETERS, 0.5)):
        for name in names:
            if name in vertex.values:
                return (vertex.values[name].astype(np.float64) * factor).astype(np.float32)
    return None


def _strands(elements, vertex_count):
    """Return (indices of vertices, None for all in order; counts; the element of strands or None)."""
    for name in _STRANDS:
        element = elements.get(name)
        if element is None:
            continue
        for items, lengths in element.items.values():
            return *_listed(items, lengths, vertex_count), element
        for names, extra in ((_SEGMENTS, 1), (_COUNTS, 0)):
            for one in names:
                if one in element.values:
                    return None, _counts(element.values[one], extra, vertex_count), element
    edge = elements.get("edge")
    if edge is not None and set(_EDGES) <= edge.values.keys():
        edges = np.stack([_whole(edge.values[name]) for name in _EDGES], axis=1)
        return *chains.polylines(edges, vertex_count), None
    raise Damaged("it has points, but no element strand, polyline or edge that makes them strands")


def _whole(values):
    """Return integral numbers as int64, others as -1."""
    values = np.asarray(values, np.float64)
    return np.where((values >= 0.0) & (values < 2.0**31), values, -1.0).astype(np.int64)


def _listed(items, lengths, vertex_count):
    indices = _whole(items)
    if len(indices) and (indices.min() < 0 or indices.max() >= vertex_count):
        raise Damaged("its lines use points that it does not have")
    return indices, lengths


def _counts(values, extra, vertex_count):
    counts = _whole(values)
    if (len(counts) and counts.min() < 0) or counts.sum() + extra * len(counts) != vertex_count:
        raise Damaged("its strands do not have the number of its points")
    return counts + extra


def _group(comment):
    number, _, name = comment.removeprefix(GROUP).strip().partition(" ")
    return (int(number) if number.isdecimal() and len(number) < 9 else 0), name[:60]


def _attributes(strand):
    """Return the attributes that Vellus writes, as arguments of `curve_sets`."""
    values = {name: np.asarray(value) for name, value in strand.values.items()}

    def columns(names, kind):
        if not set(names) <= values.keys():
            return None
        with np.errstate(invalid="ignore"):
            return np.stack([values[name] for name in names], axis=1).astype(kind)

    slots = range(GUIDE_SLOTS)
    ids, groups, guides = (columns([name], np.int32) for name in ("id", "group", "guide"))
    return {
        "ids": None if ids is None else ids[:, 0],
        "group_ids": None if groups is None else groups[:, 0],
        "is_guide": None if guides is None else guides[:, 0] != 0,
        "root_uvs": columns("uv", np.float32),
        "guide_ids": columns([f"guide_id_{slot}" for slot in slots], np.int32),
        "guide_weights": columns([f"guide_weight_{slot}" for slot in slots], np.float32),
    }
