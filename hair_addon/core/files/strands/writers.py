# SPDX-License-Identifier: GPL-3.0-or-later
"""Writers of strand files from grooms: HAIR, HairSalon's .data, PLY and .npz, of one frame, in meters.

All are in the axes of Blender, Z up, except .data, which has Y up like HairSalon's files. HAIR and .data have no
guides, groups or attributes: the strands are written, or the guides if there are no strands.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import HairError
from ..curve_file import TO_Z_UP
from ..groom_curves import Check, GroomCurves, Rows, slices
from . import hair, ply_strands

PER_METRE = 1.0

_MOST_SEGMENTS = 2**16 - 1
_MOST_CURVES = 2**31 - 1


class StrandsWriter:
    """Collects guides and strands; `writing` creates it and writes the file at the end of its context."""

    def __init__(self, has_kinds: bool) -> None:
        self._has_kinds = has_kinds
        self._added: list[tuple[GroomCurves, Check]] = []
        self._points: dict[int, np.ndarray] = {}

    def add(self, curves: GroomCurves, _moves: bool = False) -> int:
        """Add curves; returns their number for `write_points`."""
        self._added.append((curves, Check(curves)))
        return len(self._added) - 1

    def write_points(self, number: int, points: Rows) -> None:
        """Store the points (N, 3) [m] of curves. Raises `HairError` for non-finite coordinates."""
        self._points[number] = np.concatenate([*self._added[number][1].parts(points)])

    def notes(self) -> list[HairError]:
        """Return warnings about content that the file lacks."""
        if self._has_kinds or len(self.written()) == len(self._added):
            return []
        return [HairError("The file has the strands alone: its format does not tell guides from strands.")]

    def written(self) -> list[tuple[GroomCurves, np.ndarray]]:
        """Return the curves of the file with their points."""
        pairs = [(curves, self._points[number]) for number, (curves, _check) in enumerate(self._added)]
        strands = [pair for pair in pairs if not pair[0].is_guide]
        return pairs if self._has_kinds or not strands else strands


@contextmanager
def writing(path: Path, ending: str) -> Iterator[StrandsWriter]:
    """Write a groom to a path; the file is complete after the context. Raises OSError, and `HairError`.

    ending: from `export_settings.OF_STRANDS`.
    """
    write, has_kinds = _WRITERS[ending]
    writer = StrandsWriter(has_kinds)
    yield writer
    write(path, writer.written())


def _all(rows: Callable[[slice], np.ndarray], curves: GroomCurves) -> np.ndarray:
    return np.concatenate([rows(some) for some in slices(curves.curve_count)])


def _joined(written):
    """Return (points (N, 3), counts (C,), widths (N,)) of all curves, float32 and int64."""
    points = np.concatenate([points for _curves, points in written])
    counts = np.concatenate([curves.counts for curves, _points in written]).astype(np.int64)
    widths = np.concatenate([_all(curves.widths, curves) for curves, _points in written]).astype(np.float32)
    if len(counts) > _MOST_CURVES or counts.max(initial=0) - 1 > _MOST_SEGMENTS:
        raise HairError("A strand has more than {most} points: write .abc or .usd.", most=_MOST_SEGMENTS + 1)
    return points, counts, widths


def _colors(written):
    """Return linear RGB (N, 3) of all points; None unless all curves have colors."""
    if any(curves.colors is None for curves, _points in written):
        return None
    return np.concatenate([_all(curves.colors, curves) for curves, _points in written]).astype(np.float32)


# ---------------------------------------------------------------------------------------------------- HAIR


def _write_hair(path, written):
    points, counts, widths = _joined(written)
    colors = _colors(written)
    arrays = hair.SEGMENTS | hair.POINTS | hair.THICKNESS | (0 if colors is None else hair.COLORS)
    header = hair.HEADER.pack(hair.MAGIC, len(counts), len(points), arrays, 0, 0.0, 0.0, 1.0, 1.0, 1.0, hair.OURS)
    with open(path, "wb") as file:
        file.write(header)
        file.write((counts - 1).astype("<u2").tobytes())
        for values in (points, widths, *([] if colors is None else [colors])):
            file.write(values.astype("<f4").tobytes())


# ---------------------------------------------------------------------------------------------------- .data


def _write_data(path, written):
    points, counts, _widths = _joined(written)
    points = points @ TO_Z_UP["Y"].astype(np.float32) + np.float32(0.0)  # the inverse of an orthonormal matrix; no -0
    words = np.empty(1 + len(counts) + points.size, "<i4")
    words[0] = len(counts)
    starts = 1 + np.concatenate([[0], np.cumsum(1 + 3 * counts)[:-1]])
    is_point = np.ones(len(words), bool)
    is_point[0] = False
    is_point[starts] = False
    words[starts] = counts
    words[is_point] = points.astype("<f4").reshape(-1).view("<i4")
    path.write_bytes(words.tobytes())


# ---------------------------------------------------------------------------------------------------- PLY


def _write_ply(path, written):
    points, counts, widths = _joined(written)
    colors = _colors(written)
    vertices = np.empty(len(points), [(name, "<f4") for name in ("x", "y", "z", "thickness")] + _color_types(colors))
    for column, axis in enumerate("xyz"):
        vertices[axis] = points[:, column]
    vertices["thickness"] = widths
    if colors is not None:
        for column, (name, _kind) in enumerate(_color_types(colors)):
            vertices[name] = _bytes_of(colors[:, column])
    columns = _columns(written)
    strands = np.empty(len(counts), [("nsegs", "<u2"), *((name, values.dtype.str) for name, values in columns.items())])
    strands["nsegs"] = counts - 1
    for name, values in columns.items():
        strands[name] = values
    groups = dict.fromkeys((curves.group_id, curves.group_name) for curves, _points in written)
    lines = ["ply", "format binary_little_endian 1.0", f"comment {ply_strands.OURS}"]
    lines += [f"comment {ply_strands.GROUP} {number} {name}" for number, name in groups]
    for name, rows in (("vertex", vertices), ("strand", strands)):
        lines.append(f"element {name} {len(rows)}")
        lines += [f"property {_PLY_TYPES[kind]} {field}" for field, kind in rows.dtype.descr]
    with open(path, "wb") as file:
        file.write(("\n".join([*lines, "end_header"]) + "\n").encode("ascii"))
        file.write(vertices.tobytes())
        file.write(strands.tobytes())


_PLY_TYPES = {"<f4": "float", "<u2": "ushort", "<i4": "int", "|u1": "uchar"}


def _color_types(colors):
    return [] if colors is None else [(name, "|u1") for name in ("red", "green", "blue")]


def _bytes_of(linear):
    """Return linear values as sRGB of 8 bits, uint8."""
    linear = np.clip(linear, 0.0, 1.0)
    srgb = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1.0 / 2.4) - 0.055)
    return np.round(255.0 * srgb).astype(np.uint8)


def _columns(written):
    """Return {name: (C,) values} of the attributes of curves."""
    sizes = [curves.curve_count for curves, _points in written]
    every = [curves for curves, _points in written]

    def repeated(values, kind):
        return np.repeat(np.array(values, kind), sizes)

    columns = {
        "id": np.concatenate([curves.ids for curves in every]).astype("<i4"),
        "group": repeated([curves.group_id for curves in every], "<i4"),
        "guide": repeated([curves.is_guide for curves in every], "|u1"),
    }
    if all(curves.root_uvs is not None for curves in every):
        uvs = np.concatenate([curves.root_uvs for curves in every]).astype("<f4")
        columns |= {"u": uvs[:, 0], "v": uvs[:, 1]}
    if any(curves.guide_ids is not None for curves in every):
        ids, weights = (np.concatenate([_slots(c, name) for c in every]) for name in ("guide_ids", "guide_weights"))
        columns |= {f"guide_id_{slot}": ids[:, slot].astype("<i4") for slot in range(ids.shape[1])}
        columns |= {f"guide_weight_{slot}": weights[:, slot].astype("<f4") for slot in range(ids.shape[1])}
    return columns


def _slots(curves, name):
    """Return (C, 3) IDs or weights of guides; zeros for guides and strands without them."""
    values = getattr(curves, name)
    return np.zeros((curves.curve_count, 3), np.float32) if values is None else values


# ---------------------------------------------------------------------------------------------------- .npz


def _write_npz(path, written):
    names = {curves.group_id: curves.group_name for curves, _points in written}
    arrays: dict[str, Any] = {
        "up": np.array("Z"),
        "group_names": np.array([names.get(i, "") for i in range(max(names) + 1)]),
    }
    for prefix, is_guide in (("guide_", True), ("strand_", False)):
        some = [(curves, points) for curves, points in written if curves.is_guide == is_guide]
        if some:
            arrays |= {prefix + name: values for name, values in _arrays(some).items()}
    if "strand_points" in arrays:
        counts = np.concatenate([curves.counts for curves, _points in written if not curves.is_guide])
        arrays["roots"] = arrays["strand_points"].reshape(-1, 3)[np.cumsum(counts) - counts]
    with open(path, "wb") as file:
        np.savez(file, **arrays)


def _arrays(some):
    """Return {name: array} of guides or of strands, in the format of `array_grooms`."""
    points, counts, widths = _joined(some)
    every = [curves for curves, _points in some]
    of_points = {"points": points, "widths": widths}
    colors = _colors(some)
    if colors is not None:
        of_points["colors"] = colors
    if all(curves.roughness is not None for curves in every):
        of_points["roughness"] = np.concatenate([_all(c.roughness, c) for c in every]).astype(np.float32)
    if (counts == counts[0]).all():
        shape = len(counts), int(counts[0])
        arrays = {name: values.reshape(*shape, *values.shape[1:]) for name, values in of_points.items()}
    else:
        arrays = of_points | {"counts": counts}
    columns = [curves.group_id for curves in every], [curves.curve_count for curves in every]
    arrays["ids"] = np.concatenate([curves.ids for curves in every])
    arrays["groups"] = np.repeat(np.array(columns[0], np.int32), columns[1])
    if any(curves.radial_roughness is not None for curves in every):
        arrays["radial_roughness"] = np.concatenate([_radial_roughness(curves) for curves in every])
    for name in ("root_uvs", "guide_ids", "guide_weights"):
        if all(getattr(curves, name) is not None for curves in every):
            arrays[name] = np.concatenate([getattr(curves, name) for curves in every])
    return arrays


def _radial_roughness(curves):
    """Return the radial roughness (S,) of curves, or that of their look."""
    if curves.radial_roughness is not None:
        return curves.radial_roughness
    return np.full(curves.curve_count, np.nan if curves.look is None else curves.look.radial_roughness, np.float32)


# Extension → (function of a path and curves with points, whether the format separates guides from strands).
_WRITERS = {
    ".hair": (_write_hair, False),
    ".data": (_write_data, False),
    ".ply": (_write_ply, True),
    ".npz": (_write_npz, True),
}
