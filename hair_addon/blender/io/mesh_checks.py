# SPDX-License-Identifier: GPL-3.0-or-later
"""Detection of truncated mesh files, which Blender's importers read silently or crash on."""

import struct

import bpy

from ...core.errors import HairError
from ...core.files import alembic
from ..data import usable_surfaces
from .usd import usd_stage

# The keyword of an .obj line, and the number of values that must follow.
_OBJ_WORDS = {"v": 3, "vn": 3, "vt": 1, "f": 3}


def require_obj(path):
    """Raise `HairError` for an .obj with an incomplete last line. The format has no length to check."""
    with open(path, "rb") as file:
        file.seek(max(0, file.seek(0, 2) - 4096))
        last = file.read().split(b"\n")[-1].decode(errors="replace").split()
    if last and (len(last) - 1 < _OBJ_WORDS.get(last[0], 0) or last[-1][-1] in "/.-"):
        raise HairError(f"{path} ends in the middle of a line: it is truncated.")


def require_stl(path):
    """Raise `HairError` for an .stl that is neither complete text nor as long as its triangle count."""
    size = path.stat().st_size
    with open(path, "rb") as file:
        header = file.read(84)
        file.seek(max(0, size - 512))
        is_text = header.lstrip().startswith(b"solid") and b"endsolid" in file.read()
    if not is_text and (size < 84 or size != 84 + 50 * struct.unpack_from("<I", header, 80)[0]):
        raise HairError(f"{path} is not a valid STL file: it is truncated, or has another format.")


def require_alembic(path):
    """Raise `HairError` for a truncated or damaged Alembic file, on which Blender's importer crashes.

    An Ogawa file stores the offset of its root group, which is written last: a count followed by that many offsets.
    """
    size = path.stat().st_size
    with open(path, "rb") as file:
        header = file.read(16)
        if len(header) < 16 or not header.startswith(b"Ogawa"):
            raise HairError(f"{path} is not an Alembic file that Blender can read.")
        root = struct.unpack_from("<Q", header, 8)[0]
        file.seek(min(root, size))
        count = file.read(8)
    if header[5] != 0xFF or len(count) < 8 or root + 8 + 8 * struct.unpack("<Q", count)[0] > size:
        raise HairError(f"{path} is not a complete Alembic file: it is truncated.")
    alembic.reader.require_whole(path)


def require_usd(path):
    """Raise `HairError` for a USD file that cannot be parsed, or has a mesh whose faces do not fit its points.

    Blender's importer silently drops such faces, or the mesh.
    """
    bpy.utils.expose_bundled_modules()
    from pxr import Tf, Usd, UsdGeom

    try:
        stage = Usd.Stage.Open(str(path))
        meshes = [UsdGeom.Mesh(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
    except Tf.ErrorException as error:
        raise HairError(f"{path} is not a valid USD file: it is damaged, or has another format.") from error
    for mesh in meshes:
        attributes = mesh.GetFaceVertexCountsAttr(), mesh.GetFaceVertexIndicesAttr(), mesh.GetPointsAttr()
        if not _fit(*(usd_stage.values_at(one, Usd.TimeCode.EarliestTime()) for one in attributes)):
            raise HairError(f"{path} is damaged: the faces of its mesh {mesh.GetPath()} do not match its points.")


def _fit(counts, indices, points):
    """Whether faces with numbers of corners and vertices of corners match points; None: a value that is no array."""
    if counts is None or indices is None or points is None:
        return False
    is_whole = counts.sum() == len(indices) and counts.min(initial=0) >= 0
    return is_whole and indices.min(initial=0) >= 0 and indices.max(initial=-1) < len(points)


def require_imported(path):
    """Raise `HairError` if an imported mesh has faces with invalid vertex or corner indices."""
    for mesh in bpy.data.meshes:
        if not usable_surfaces.is_whole(mesh):
            raise HairError(f"{path} is damaged: the faces of its mesh {mesh.name} do not match its points.")


_PLY_TYPES = {
    **dict.fromkeys(("char", "int8"), "b"),
    **dict.fromkeys(("uchar", "uint8"), "B"),
    **dict.fromkeys(("short", "int16"), "h"),
    **dict.fromkeys(("ushort", "uint16"), "H"),
    **dict.fromkeys(("int", "int32"), "i"),
    **dict.fromkeys(("uint", "uint32"), "I"),
    **dict.fromkeys(("float", "float32"), "f"),
    **dict.fromkeys(("double", "float64"), "d"),
}
_PLY_FORMATS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


def require_ply(path):
    """Raise `HairError` for a .ply shorter than its header states, on which Blender crashes."""
    content = path.read_bytes()
    try:
        byte_order, elements, start = _ply_header(content)
        end = (
            _ply_text_end(content, elements, start)
            if not byte_order
            else _ply_end(content, byte_order, elements, start)
        )
    except (ValueError, KeyError, IndexError, struct.error) as error:
        raise HairError(f"{path} is not a valid PLY file: it is truncated, or has another format.") from error
    if end > len(content):
        raise HairError(f"{path} is not a complete PLY file: it is truncated.")


def _ply_header(content):
    """Return (byte order, "" for text; [(count, [struct formats of a row, pairs for lists])]; offset of the rows)."""
    mark = content.index(b"end_header")
    start = content.index(b"\n", mark) + 1
    byte_order, elements = None, []
    if not content.startswith(b"ply"):
        raise ValueError("no PLY")
    for words in (line.split() for line in content[:mark].decode("ascii").splitlines()):
        if words[:1] == ["format"]:
            byte_order = _PLY_FORMATS[words[1]]
        elif words[:1] == ["element"]:
            elements.append((int(words[2]), []))
        elif words[:2] == ["property", "list"]:
            elements[-1][1].append((_PLY_TYPES[words[2]], _PLY_TYPES[words[3]]))
        elif words[:1] == ["property"]:
            elements[-1][1].append(_PLY_TYPES[words[1]])
    if byte_order is None or any(count < 0 for count, _row in elements):
        raise ValueError("no format")
    return byte_order, elements, start


def _ply_end(content, byte_order, elements, place):
    """Return the offset of the end of the last row, beyond the end of a truncated file."""
    for count, row in elements:
        if not any(isinstance(part, tuple) for part in row):
            place += count * struct.calcsize(byte_order + "".join(row))
            continue
        for _ in range(count):
            for part in row:
                if isinstance(part, tuple):
                    length = struct.unpack_from(byte_order + part[0], content, place)[0]
                    if length < 0:
                        raise ValueError("a list of negative length")
                    place += struct.calcsize(byte_order + part[0]) + length * struct.calcsize(byte_order + part[1])
                else:
                    place += struct.calcsize(byte_order + part)
    return place


def _ply_text_end(content, elements, start):
    """Return the length of a complete text, more if rows are missing; raises ValueError or IndexError for bad rows."""
    rows = content[start:].decode("ascii").splitlines()
    row_number = 0
    for count, row in elements:
        for words in (line.split() for line in rows[row_number : row_number + count]):
            place = 0
            for part in row:
                place += 1 + (int(words[place]) if isinstance(part, tuple) else 0)
            if place > len(words) or not words:
                raise ValueError("a row is truncated")
        row_number += count
    return len(content) if row_number <= len(rows) else len(content) + 1
