# SPDX-License-Identifier: GPL-3.0-or-later
"""Completeness checks of image files by their structure, without decoding pixels: thousands of files per second.

A truncated PNG lacks its end chunk, a truncated OpenEXR its table of chunk offsets or its last chunks.
"""

import os
import stat
import struct
from pathlib import Path

import numpy as np

from ..errors import HairError

_PNG = b"\x89PNG\r\n\x1a\n"
_PNG_END = b"\0\0\0\0IEND\xaeB`\x82"
_EXR = b"\x76\x2f\x31\x01"
_SIGNATURES = {".png": _PNG, ".exr": _EXR}

# Bits of the version of an OpenEXR file.
_IS_TILED, _IS_DEEP, _HAS_PARTS = 0x200, 0x800, 0x1000

# Rows of pixels in a chunk, by OpenEXR's compression number: none, RLE, ZIPS, ZIP, PIZ, PXR24, B44, B44A, DWAA, ….
_ROWS = (1, 1, 1, 16, 32, 16, 32, 32, 32, 256, 256, 32)


def require_whole(path: str | Path, name: str) -> None:
    """Raise `HairError` unless a file is a complete picture; name: for the message."""
    if not is_whole(path):
        raise HairError(f"{name} is incomplete: the disk may be full.")


def is_whole(path: str | Path) -> bool:
    """Return whether a path is a complete picture of the format of its suffix, .png or .exr."""
    size, head, tail = _ends(path)
    if not head.startswith(_SIGNATURES[Path(path).suffix.lower()]):
        return False
    if head.startswith(_PNG):
        return _PNG_END in tail
    try:
        return _is_whole_exr(path, size, head)
    except (LookupError, ValueError, struct.error):
        return False


def is_broken(path: str | Path) -> bool:
    """Return whether a path is an empty file or a truncated picture."""
    size, head, _tail = _ends(path)
    if size is None:
        return False
    return not size or (head.startswith(_SIGNATURES[Path(path).suffix.lower()]) and not is_whole(path))


def _ends(path):
    """Return (size, first bytes, last bytes) of a plain file; (None, b"", b"") if the file is unreadable."""
    try:
        # O_NONBLOCK: opening a pipe without a writer would block.
        flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
        with open(path, "rb", opener=lambda name, _flags: os.open(name, flags)) as file:
            status = os.fstat(file.fileno())
            if not stat.S_ISREG(status.st_mode):
                return None, b"", b""
            head = file.read(65_536)
            file.seek(max(0, status.st_size - 1024))
            return status.st_size, head, file.read()
    except OSError:
        return None, b"", b""


def _is_whole_exr(path, size, head):
    """Return whether all chunks in an OpenEXR file's offset table lie within the file."""
    while True:
        try:
            counts, place, version = _chunk_counts(head)
            end = place + 8 * sum(counts)
            if end <= len(head):
                break
        except (LookupError, ValueError, struct.error):
            end = 0
        if len(head) == size or end > size:
            return False
        with open(path, "rb") as file:
            head = file.read(max(4 * len(head), end))
    if version & (_IS_TILED | _IS_DEEP):
        return True  # Blender does not write such files
    offsets = np.frombuffer(head, "<u8", sum(counts), place)
    if not len(offsets) or offsets.min() < end or offsets.max() >= size:
        return False
    last, before = int(offsets.max()), 8 if version & _HAS_PARTS else 4  # bytes of a chunk's part number and first row
    with open(path, "rb") as file:
        file.seek(last + before)
        length = struct.unpack("<i", file.read(4))[0]
    return length >= 0 and last + before + 4 + length <= size


def _chunk_counts(head):
    """Return ([number of chunks of each part], start of the offset table, version field); raises for short heads."""
    version, place, counts = struct.unpack_from("<I", head, 4)[0], 8, []
    while True:
        attributes, place = _attributes(head, place)
        if not attributes:  # the empty header that ends a multi-part list
            return counts, place, version
        counts.append(_chunk_count(attributes))
        if not version & _HAS_PARTS:
            return counts, place, version


def _attributes(head, place):
    """Return ({name: bytes} of a part's header, end of the header)."""
    found = {}
    while head[place]:
        name_end = head.index(b"\0", place)
        kind_end = head.index(b"\0", name_end + 1)
        size = struct.unpack_from("<i", head, kind_end + 1)[0]
        start = kind_end + 5
        if size < 0 or start + size > len(head):
            raise ValueError("truncated attribute")
        found[head[place:name_end]] = head[start : start + size]
        place = start + size
    return found, place + 1


def _chunk_count(attributes):
    if b"chunkCount" in attributes:
        count = struct.unpack("<i", attributes[b"chunkCount"])[0]
    else:
        _left, top, _right, bottom = struct.unpack("<4i", attributes[b"dataWindow"])
        count = -(-(bottom - top + 1) // _ROWS[attributes[b"compression"][0]])
    if count < 1:
        raise ValueError("part without pixels")
    return count
