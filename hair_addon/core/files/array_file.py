# SPDX-License-Identifier: GPL-3.0-or-later
"""Arrays in an uncompressed .npz file. A file is read only if `write` would produce exactly its bytes.

No parser runs on untrusted files: names, types and shapes are known before a file is opened, and they determine every
byte except the arrays' contents and checksums.
"""

import binascii
import math
import struct
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..errors import HairError
from . import untrusted_file

# Name → (type of NumPy, shape).
Layout = Mapping[str, tuple[str, tuple[int, ...]]]

TYPES = ("<f4", "<f8", "<i4", "<i8", "|u1")
MOST_BYTES = 2**32 - 2**16  # limit of a file's size: larger files would need ZIP64

_DATE = 0x0021  # 1 January 1980: equal arrays give equal files
_VERSION = 20
_ON_UNIX = 3 << 8
_PLAIN_FILE = 0o100644 << 16
_LOCAL = struct.Struct("<4s5H3L2H")
_CENTRAL = struct.Struct("<4s6H3L5H2L")
_END = struct.Struct("<4s4H2LH")


def encoded(arrays: Mapping[str, np.ndarray]) -> list[bytes | memoryview]:
    """Return the consecutive parts of a file. Raises `HairError` for arrays that `decoded` would refuse."""
    layout = layout_of(arrays)
    require_layout(layout)
    if not all(_is_finite(array) for array in arrays.values()):
        raise HairError("Non-finite numbers cannot be cached.")
    held = {name: np.ascontiguousarray(array, layout[name][0]).reshape(-1) for name, array in arrays.items()}
    return _file_of(layout, {name: array.view(np.uint8).data for name, array in held.items()})


def decoded(data: bytes, layout: Layout) -> dict[str, np.ndarray] | None:
    """Return the arrays of a file's bytes; None unless `encoded` produces this file for the layout."""
    if len(data) != size_of(layout):
        return None
    view, found, place = memoryview(data), {}, 0
    for name, (kind, shape) in layout.items():
        place += _LOCAL.size + len(_member(name)) + len(_header(kind, shape))
        found[name] = view[place : place + _byte_count(kind, shape)]
        place += len(found[name])
    place = 0
    for part in _file_of(layout, found):
        if isinstance(part, bytes) and view[place : place + len(part)] != part:  # other parts are views of `data`
            return None
        place += len(part)
    arrays = {name: np.frombuffer(found[name], kind).reshape(shape) for name, (kind, shape) in layout.items()}
    return arrays if all(map(_is_finite, arrays.values())) else None


def write(path: Path, arrays: Mapping[str, np.ndarray]) -> None:
    """Write arrays (`TYPES`, any shapes) to a file. Raises OSError, and `HairError` like `encoded`."""
    parts = encoded(arrays)
    with open(path, "wb", buffering=0) as file:
        for part in parts:
            rest = memoryview(part)
            while rest:  # a write to a disk that is almost full may be partial
                rest = rest[file.write(rest) :]


def read(path: Path, layout: Layout) -> dict[str, np.ndarray]:
    """Return the arrays of a file, read-only. Raises `HairError` unless `write` produces this file for the layout."""
    require_layout(layout)
    arrays = decoded(untrusted_file.read(path, size_of(layout)), layout)
    if arrays is None:
        raise HairError("{path} cannot be read: {cause}.", path=path, cause="it is damaged, or of another simulation")
    return arrays


def layout_of(arrays: Mapping[str, np.ndarray]) -> dict[str, tuple[str, tuple[int, ...]]]:
    """Return the layout of arrays, in their order."""
    return {name: (array.dtype.newbyteorder("<").str, array.shape) for name, array in arrays.items()}


def require_layout(layout: Layout) -> None:
    """Raise `HairError` unless a layout is valid: known types, shapes of at most four axes, a limited size."""
    for name, (kind, shape) in layout.items():
        is_named = name.isascii() and name.isidentifier() and len(name) <= 32
        if not is_named or kind not in TYPES or len(shape) > 4 or not all(0 <= size < 2**31 for size in shape):
            raise HairError("Arrays of this type or shape cannot be cached: {name}.", name=name[:32])
    if size_of(layout) > MOST_BYTES:
        raise HairError("A file of the cache cannot be larger than 4 GB: simulate fewer guides.")


def size_of(layout: Layout) -> int:
    """Return the number of bytes of a file with a layout."""
    size = _END.size
    for name, (kind, shape) in layout.items():
        size += _LOCAL.size + _CENTRAL.size + 2 * len(_member(name)) + len(_header(kind, shape))
        size += _byte_count(kind, shape)
    return size


def _byte_count(kind, shape):
    return int(kind[2:]) * math.prod(shape)


def _is_finite(array):
    return array.dtype.kind != "f" or bool(np.isfinite(array).all())


def _member(name):
    return f"{name}.npy".encode()


def _header(kind, shape):
    """Return a .npy file's magic string, version 1.0 and header, padded to 64 bytes as NumPy does."""
    text = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape!r}, }}"
    size = -(-(10 + len(text) + 1) // 64) * 64 - 10
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", size) + text.ljust(size - 1).encode() + b"\n"


def _file_of(layout, contents):
    """Return the parts of a file: the local header, array header and bytes of each member, then the directory."""
    parts, directory, place = [], b"", 0
    for name, (kind, shape) in layout.items():
        member, header, content = _member(name), _header(kind, shape), contents[name]
        size, checksum = len(header) + len(content), binascii.crc32(content, binascii.crc32(header))
        # Version, flags, method (stored), time, date, checksum, both sizes, length of the name: common to both headers.
        common = (_VERSION, 0, 0, 0, _DATE, checksum, size, size, len(member))
        parts += [_LOCAL.pack(b"PK\x03\x04", *common, 0) + member + header, content]
        directory += _CENTRAL.pack(b"PK\x01\x02", _ON_UNIX | _VERSION, *common, 0, 0, 0, 0, _PLAIN_FILE, place) + member
        place += _LOCAL.size + len(member) + size
    end = _END.pack(b"PK\x05\x06", 0, 0, len(layout), len(layout), len(directory), place, 0)
    return [*parts, directory + end]
