# SPDX-License-Identifier: GPL-3.0-or-later
"""The Ogawa container of [Alembic26] files: a tree of groups, whose leaves are data.

Children are written before their group, and large data in parts: memory is bounded by the size of one part.

    header   "Ogawa", 0xff when the file is complete, version 1 (16 bits, big-endian), position of the root group
    data     number of bytes, the bytes
    group    number of children, their addresses: positions in the file, with the highest bit set for data

All other numbers are little-endian and have 64 bits.
"""

import hashlib
import struct
from collections.abc import Iterable, Sequence
from typing import BinaryIO

import numpy as np

Data = bytes | bytearray | memoryview | np.ndarray

EMPTY_GROUP = 0
EMPTY_DATA = 1 << 63

DIGEST_SIZE = 16  # [bytes], before the content of each sample; readers treat equal digest and size as equal content

_HEADER = struct.Struct("<5sB2sQ")
_NUMBER = struct.Struct("<Q")


def digest_of(*parts: Data) -> bytes:
    """Return the digest of the bytes of all parts. Any good hash is valid: readers only compare digests."""
    digest = hashlib.blake2b(digest_size=DIGEST_SIZE)
    for part in parts:
        digest.update(part)
    return digest.digest()


class OgawaWriter:
    """Writes to an empty, seekable file. Readers reject a file until `finish` is called."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self._samples: dict[tuple[int, bytes], int] = {}  # (size, digest) → address
        self._write_header(False, 0)
        self._end = _HEADER.size

    def data(self, content: bytes) -> int:
        """Write bytes; returns their address."""
        if not content:
            return EMPTY_DATA
        address = self._end | EMPTY_DATA
        self._append(_NUMBER.pack(len(content)), content)
        return address

    def sample(self, parts: Iterable[Data]) -> tuple[int, int, bytes]:
        """Write a sample, its digest and then its content in parts; returns (address, bytes of content, digest).

        Equal samples are stored once; an empty sample is not stored.
        """
        start, digest = self._end, hashlib.blake2b(digest_size=DIGEST_SIZE)
        self._append(bytes(_NUMBER.size + DIGEST_SIZE))
        for part in parts:
            digest.update(part)
            self._append(part)
        size, digest_bytes = self._end - start - _NUMBER.size, digest.digest()
        place = EMPTY_DATA if size == DIGEST_SIZE else start | EMPTY_DATA
        address = self._samples.setdefault((size, digest_bytes), place)
        self._file.seek(start)
        if address != start | EMPTY_DATA:
            self._end = start
        else:
            self._file.write(_NUMBER.pack(size) + digest_bytes)
            self._file.seek(self._end)
        return address, size - DIGEST_SIZE, digest_bytes

    def group(self, children: Sequence[int]) -> int:
        """Write a group of addresses; returns the group's address."""
        if not children:
            return EMPTY_GROUP
        address = self._end
        self._append(struct.pack(f"<{1 + len(children)}Q", len(children), *children))
        return address

    def finish(self, root: int) -> None:
        """Write the root group's address and mark the file as complete."""
        self._file.truncate(self._end)
        self._write_header(True, root)

    def _append(self, *parts):
        for part in parts:
            self._end += self._file.write(part)

    def _write_header(self, is_complete, root):
        self._file.seek(0)
        self._file.write(_HEADER.pack(b"Ogawa", 0xFF if is_complete else 0, b"\x00\x01", root))
