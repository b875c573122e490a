# SPDX-License-Identifier: GPL-3.0-or-later
"""Reader of untrusted [Alembic26] archives in Ogawa; writer.py and ogawa.py document the layout.

Every position, size and count is checked before it is used, and each object and property is visited once: memory and
time are bounded by the size of the file. Damaged data raises `Damaged`.
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

from ...errors import HairError, cause_of

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
_ACYCLIC = float(np.finfo(np.float64).max) / 32.0  # a cycle of this length marks acyclic times
_MOST_DEPTH = 200  # nesting of objects and of compounds
_READ_ANEW = 64  # limit of bytes read, in file sizes: samples may be shared, but must not fill the memory

_HDF5 = b"\x89HDF\r\n\x1a\n"


class Damaged(ValueError):
    """A file's content violates the format."""


@dataclass(frozen=True)
class Times:
    """Times of samples [s]: a cycle of times that repeats after each step."""

    step: float
    cycle: tuple[float, ...]

    def at(self, indices: Sequence[int]) -> np.ndarray:
        """Return the times (n,) of samples."""
        count, found = len(self.cycle), []
        for index in indices:
            if self.step >= _ACYCLIC:
                found.append(self.cycle[min(index, count - 1)])
            else:
                found.append(self.cycle[index % count] + self.step * (index // count))
        return np.array(found)


@dataclass(frozen=True)
class Property:
    """A property: the children of a compound, or samples, whose values `Archive.values` reads.

    kind: NumPy's type, None for strings; extent: numbers in an element; addresses: (n,) of the contents of samples that
    differ from the previous one; times: of the samples [s].
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
    """An object of an archive; path: names from the top-level object to this one."""

    archive: "Archive" = field(repr=False)
    path: tuple[str, ...]
    metadata: Mapping[str, str]
    group: tuple[int, ...] = field(repr=False)

    @cached_property
    def properties(self) -> Mapping[str, Property]:
        """The object's properties by name."""
        return self.archive.compound(self.group[0]) if len(self.group) > 1 else {}

    def children(self) -> Iterator["Object"]:
        """Yield the child objects; may be called once."""
        yield from self.archive.children(self)


class Archive:
    """An archive that is open for reading: a context manager. Raises `HairError` for other files, and `Damaged`."""

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
        """Return the root object. Must be called first."""
        header = self._bytes(0, min(_HEADER_SIZE, self._size))
        if header.startswith(_HDF5):
            raise HairError(
                "{path} is an Alembic file in the old HDF5 format: convert it to Ogawa with abcconvert -toOgawa.",
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
        """Yield the child objects of an object."""
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
        """Return the properties of a compound by name."""
        if depth > _MOST_DEPTH:
            raise Damaged
        group = self._visit(address)
        if not group:
            return {}
        headers, found = _Bytes(self._content(group[-1])), {}
        for child in group[:-1]:
            entry = self._property(headers, child, depth)
            found[entry.name] = entry
        return found

    def values(self, target: Property, sample: int = 0) -> Any:
        """Return the elements at a property's n-th address: (n,) or (n, extent) numbers, or a list of str."""
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

    def require_complete(self, properties: Mapping[str, Property]) -> None:
        """Raise `Damaged` unless all samples of properties and of their children are within the file."""
        for one in properties.values():
            self.require_complete(one.children)
            for address in one.addresses:
                self._size_of(address)

    def _property(self, headers, address, depth):
        """Return a property with its children; headers: at the header of the property, which is consumed."""
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
            return Property(name, metadata)  # unused types, such as wide strings
        addresses = self._group(address)[:: 1 if form == 1 else 2]
        if count and not addresses:
            raise Damaged
        # The samples that differ from the previous one, and the last sample before the first change.
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
        """Return the addresses in a group. Raises `Damaged` if the group belongs to two objects or compounds."""
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
        """Return the number of bytes of a content. Raises `Damaged` unless the content lies within the file."""
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
    """Raise `HairError` unless all addresses of an archive lie within the file, which other readers do not check."""
    try:
        with Archive(path) as archive:
            pending = [archive.top()]
            while pending:
                one = pending.pop()
                pending += one.children()
                archive.require_complete(one.properties)
    except (Damaged, OSError) as error:
        raise HairError("{path} is a damaged Alembic file.", path=path) from error


class _Bytes:
    """A cursor over bytes."""

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
