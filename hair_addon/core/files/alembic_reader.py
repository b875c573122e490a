# SPDX-License-Identifier: GPL-3.0-or-later
"""Reading of [Alembic26] archives in Ogawa that anybody may have made; alembic.py and ogawa.py say what is where.

Every position, size and count is checked before anything is read by it, and each object and property is visited once:
reading takes memory and time by the size of the file. What is damaged raises `Damaged`.
"""

import os
import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np

from ..errors import HairError, cause_of

# Number in the file → NumPy's type of a value; None for strings.
_KINDS: Mapping[int, str | None] = {
    0: "|u1",
    1: "|u1",
    2: "|i1",
    3: "<u2",
    4: "<i2",
    5: "<u4",
    6: "<i4",
    7: "<u8",
    8: "<i8",
    9: "<f2",
    10: "<f4",
    11: "<f8",
    12: None,
}

_DATA = 1 << 63
_DIGEST = 16  # [bytes] before the content of a sample
_HEADER_SIZE = 16
_ACYCLIC = float(np.finfo(np.float64).max) / 32.0  # the length of a cycle of times that do not repeat
_MOST_DEPTH = 200  # objects in objects, compounds in compounds
_READ_ANEW = 64  # how often the content of a file is read: samples may be shared, but not to fill the memory

_HDF5 = b"\x89HDF\r\n\x1a\n"


class Damaged(ValueError):
    """What a file has is not what the format allows."""


@dataclass(frozen=True)
class Times:
    """Times of samples [s]: those of a cycle, which repeats each step."""

    step: float
    cycle: tuple[float, ...]

    def at(self, indices: Sequence[int]) -> np.ndarray:
        """(n,) of samples."""
        count, found = len(self.cycle), []
        for index in indices:
            if self.step >= _ACYCLIC:
                found.append(self.cycle[min(index, count - 1)])
            else:
                found.append(self.cycle[index % count] + self.step * (index // count))
        return np.array(found)


@dataclass(frozen=True)
class Property:
    """A property: of a compound its children; of others the values of samples, which `Archive.values` reads.

    kind: NumPy's type, None for strings; extent: numbers in an element; addresses: (n,) of the contents of samples that
    differ from the one before, and times of these [s].
    """

    name: str
    metadata: Mapping[str, str]
    children: Mapping[str, "Property"] = field(default_factory=dict)
    kind: str | None = None
    extent: int = 1
    addresses: tuple[int, ...] = ()
    times: np.ndarray = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True)
class Object:
    """An object of an archive, with the names of those that it is in, from the top."""

    archive: "Archive" = field(repr=False)
    path: tuple[str, ...]
    metadata: Mapping[str, str]
    group: tuple[int, ...] = field(repr=False)

    @cached_property
    def properties(self) -> Mapping[str, Property]:
        """By name."""
        return self.archive.compound(self.group[0]) if len(self.group) > 1 else {}

    def children(self) -> Iterator["Object"]:
        """The objects in it; once."""
        yield from self.archive.children(self)


class Archive:
    """An archive, open for reading: a context. Raises `HairError` for what is no archive, and `Damaged`."""

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            self._file = open(path, "rb")
            self._size = os.fstat(self._file.fileno()).st_size
        except OSError as error:
            raise HairError("{path} cannot be read: {cause}.", path=path, cause=cause_of(error)) from error
        self._left = _READ_ANEW * self._size
        self._visited: set[int] = set()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._file.close()

    def top(self) -> Object:
        """The object that holds all others. Called first."""
        header = self._bytes(0, min(_HEADER_SIZE, self._size))
        if header.startswith(_HDF5):
            raise HairError(
                "{path} is an Alembic file of the old kind, HDF5: convert it to Ogawa, with abcconvert -toOgawa.",
                path=self.path,
            )
        if not header.startswith(b"Ogawa") or len(header) < _HEADER_SIZE:
            raise HairError("{path} is not an Alembic file.", path=self.path)
        if header[5] != 0xFF:
            raise HairError("{path} is not a complete Alembic file: it was not written to its end.", path=self.path)
        root = self._group(struct.unpack_from("<Q", header, 8)[0])
        if len(root) < 6:
            raise Damaged
        self.metadata = _metadata(self._content(root[3]))
        self._times = list(self._samplings(self._content(root[4])))
        self._table = [{}, *self._indexed_metadata(self._content(root[5]))]
        return Object(self, (), {}, self._visit(root[2]))

    def children(self, parent: Object) -> Iterator[Object]:
        """The objects in another."""
        group = parent.group
        if len(group) < 3:
            return
        headers = _Bytes(self._content(group[-1]))
        headers.end -= 2 * _DIGEST
        if len(parent.path) >= _MOST_DEPTH:
            raise Damaged
        for address in group[1:-1]:
            name = headers.take(headers.number("I")).decode(errors="replace")
            index = headers.number("B")
            metadata = self._known(index) if index != 0xFF else _metadata(headers.take(headers.number("I")))
            yield Object(self, (*parent.path, name), metadata, self._visit(address))

    def compound(self, address: int, depth: int = 0) -> dict[str, Property]:
        """The properties of a compound, by name."""
        if depth > _MOST_DEPTH:
            raise Damaged
        group = self._visit(address)
        if not group:
            return {}
        headers, found = _Bytes(self._content(group[-1])), {}
        for child in group[:-1]:
            made = self._property(headers, child, depth)
            found[made.name] = made
        return found

    def values(self, target: Property, sample: int = 0) -> Any:
        """The elements of a property's n-th address: (n,) or (n, extent) numbers, or a list of str."""
        if not target.addresses:
            raise Damaged
        content = self._content(target.addresses[min(sample, len(target.addresses) - 1)])
        if content and len(content) < _DIGEST:
            raise Damaged
        content = content[_DIGEST:]
        if target.kind is None:
            return [text.decode(errors="replace") for text in content.removesuffix(b"\0").split(b"\0")]
        if len(content) % (np.dtype(target.kind).itemsize * target.extent):
            raise Damaged
        elements = np.frombuffer(content, target.kind)
        return elements if target.extent == 1 else elements.reshape(-1, target.extent)

    def require_there(self, properties: Mapping[str, Property]) -> None:
        """Raise `Damaged` unless all samples of properties, and of those in them, are in the file."""
        for one in properties.values():
            self.require_there(one.children)
            for address in one.addresses:
                self._size_of(address)

    def _property(self, headers, address, depth):
        """A property and all in it; headers: at the place of its own, which is passed."""
        bits = headers.number("I")
        width = "BHI"[min(bits >> 2 & 3, 2)]
        form, kind, extent = bits & 3, bits >> 4 & 0xF, bits >> 12 & 0xFF
        count = sampling = first = last = 0
        if form:
            count = headers.number(width)
            first, last = (0, 0) if bits & 0x800 else (1, count - 1)
            if bits & 0x200:
                first, last = headers.number(width), headers.number(width)
            sampling = headers.number(width) if bits & 0x100 else 0
        name = headers.take(headers.number(width)).decode(errors="replace")
        index = bits >> 20 & 0xFF
        metadata = self._known(index) if index != 0xFF else _metadata(headers.take(headers.number(width)))
        if not form:
            return Property(name, metadata, self.compound(address, depth + 1))
        if kind not in _KINDS or not extent:
            return Property(name, metadata)  # such as text of wide characters: nothing of it is needed
        addresses = self._group(address)[:: 1 if form == 1 else 2]
        if count and not addresses:
            raise Damaged
        # The samples that differ from the one before, and the last one before they begin to.
        changes = range(first, last + 1) if 0 < first <= last < count else range(0)
        if changes and len(changes) >= len(addresses):
            raise Damaged
        indices, held = [0, *changes], [*range(len(changes) + 1)]
        if changes and first > 1:
            indices.insert(1, first - 1)
            held.insert(1, 0)
        if not count:
            indices, held = [], []
        if sampling >= len(self._times):
            raise Damaged
        times = self._times[sampling].at(indices)
        return Property(name, metadata, {}, _KINDS[kind], extent, tuple(addresses[n] for n in held), times)

    def _known(self, index):
        if index >= len(self._table):
            raise Damaged
        return self._table[index]

    def _samplings(self, content):
        rest = _Bytes(content)
        while rest.place < rest.end:
            rest.number("I")
            step, count = rest.number("d"), rest.number("I")
            if not count:
                raise Damaged
            cycle = struct.unpack(f"<{count}d", rest.take(8 * count))
            if not np.isfinite([step, *cycle]).all():
                raise Damaged
            yield Times(step, cycle)

    def _indexed_metadata(self, content):
        rest = _Bytes(content)
        while rest.place < rest.end:
            yield _metadata(rest.take(rest.number("B")))

    def _visit(self, address):
        """A group that belongs to one object or compound."""
        if address and address in self._visited:
            raise Damaged
        self._visited.add(address)
        return self._group(address)

    def _group(self, address):
        if not address:
            return ()
        if address & _DATA:
            if address == _DATA:
                return ()
            raise Damaged
        (count,) = struct.unpack("<Q", self._bytes(address, 8))
        if count > self._size // 8:
            raise Damaged
        return struct.unpack(f"<{count}Q", self._bytes(address + 8, 8 * count))

    def _content(self, address):
        size = self._size_of(address)
        return self._bytes((address & ~_DATA) + 8, size) if size else b""

    def _size_of(self, address):
        """The number of bytes of a content, all of which are in the file."""
        if not address & _DATA:
            raise Damaged
        place = address & ~_DATA
        if not place:
            return 0
        (size,) = struct.unpack("<Q", self._bytes(place, 8))
        if size > self._size - place - 8:
            raise Damaged
        return size

    def _bytes(self, place, size):
        if place + size > self._size or size > self._left:
            raise Damaged
        self._left -= size
        self._file.seek(place)
        data = self._file.read(size)
        if len(data) < size:
            raise Damaged
        return data


def require_whole(path: Path) -> None:
    """Raise `HairError` unless everything that an archive names is within it, as other readers take for granted."""
    try:
        with Archive(path) as archive:
            pending = [archive.top()]
            while pending:
                one = pending.pop()
                pending += one.children()
                archive.require_there(one.properties)
    except (Damaged, OSError) as error:
        raise HairError("{path} is a damaged Alembic file.", path=path) from error


class _Bytes:
    """Bytes that are taken from the front."""

    def __init__(self, data):
        self._data, self.place, self.end = data, 0, len(data)

    def take(self, size):
        if self.place + size > self.end:
            raise Damaged
        self.place += size
        return self._data[self.place - size : self.place]

    def number(self, kind):
        (value,) = struct.unpack(f"<{kind}", self.take(struct.calcsize(f"<{kind}")))
        return value


def _metadata(content):
    entries = (entry.partition("=") for entry in content.decode(errors="replace").split(";"))
    return {key: value for key, _equals, value in entries if key}
