# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of meshes that were cut short: what Blender's importers read without a word, or end the process over."""

import struct

from ..core.errors import HairError

# What a line of an .obj begins with, and how much has to follow.
_OBJ_WORDS = {"v": 3, "vn": 3, "vt": 1, "f": 3}


def require_obj(path):
    """Raise `HairError` for an .obj whose last line breaks off. More cannot be known: it says nothing of its length."""
    with open(path, "rb") as file:
        file.seek(max(0, file.seek(0, 2) - 4096))
        last = file.read().split(b"\n")[-1].decode(errors="replace").split()
    if last and (len(last) - 1 < _OBJ_WORDS.get(last[0], 0) or last[-1][-1] in "/.-"):
        raise HairError(f"{path} ends in the middle of a line: it was cut short.")


def require_stl(path):
    """Raise `HairError` for an .stl that is no text to its end, nor as long as its triangles need."""
    size = path.stat().st_size
    with open(path, "rb") as file:
        header = file.read(84)
        file.seek(max(0, size - 512))
        is_text = header.lstrip().startswith(b"solid") and b"endsolid" in file.read()
    if not is_text and (size < 84 or size != 84 + 50 * struct.unpack_from("<I", header, 80)[0]):
        raise HairError(f"{path} is no whole STL file: it was cut short, or is something else.")


def require_alembic(path):
    """Raise `HairError` for an Alembic file without its end, over which Blender's importer ends the process.

    An Ogawa file names the place of its root group, which is written last: a count, and as many places.
    """
    size = path.stat().st_size
    with open(path, "rb") as file:
        header = file.read(16)
        if len(header) < 16 or not header.startswith(b"Ogawa"):
            raise HairError(f"{path} is no Alembic file of the kind that Blender reads.")
        root = struct.unpack_from("<Q", header, 8)[0]
        file.seek(min(root, size))
        count = file.read(8)
    if header[5] != 0xFF or len(count) < 8 or root + 8 + 8 * struct.unpack("<Q", count)[0] > size:
        raise HairError(f"{path} is no whole Alembic file: it was cut short.")
