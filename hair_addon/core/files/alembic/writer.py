# SPDX-License-Identifier: GPL-3.0-or-later
"""Writer of [Alembic26] archives in Ogawa: objects with properties, some of which have a sample for each time.

An archive is written bottom-up: samples, then their properties, the compounds of properties, the objects, and finally
the archive.

    archive   version of this layout, version of the library, root object, metadata, time samplings, table of metadata
    object    its properties (a compound), its child objects, their headers and two digests
    compound  its properties, their headers
    array     for each sample its content and its dimensions; a scalar has only the content

A header packs a property's type and number of samples in bits, see `_property_header`.
"""

import struct
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import BinaryIO

import numpy as np
from numpy.typing import ArrayLike

from . import ogawa

# Types of values: number in the file, name in metadata, NumPy's type.
TYPES = {
    "bool": (0, "bool_t", "|u1"),
    "uint8": (1, "uint8_t", "|u1"),
    "int16": (4, "int16_t", "<i2"),
    "int32": (6, "int32_t", "<i4"),
    "float32": (10, "float32_t", "<f4"),
    "float64": (11, "float64_t", "<f8"),
    "string": (12, "string", ""),
}

_LAYOUT_VERSION = 0
_LIBRARY_VERSION = 10700  # Alembic 1.7.0, whose layout is written
_MOST_INDEXED = 254  # entries of the metadata table; further metadata is written in full

Metadata = Mapping[str, str]


@dataclass
class Property:
    """A property: the fields of its header, and the addresses of its samples, or a compound's own address.

    type and extent: of an element, such as float32 and 3 for points; type "" for a compound. `AlembicWriter.add_sample`
    adds samples to a new property.
    """

    name: str
    type: str
    extent: int
    metadata: str
    is_array: bool = False
    sampling: int = 0  # index of its time sampling
    addresses: list[int] = field(default_factory=list)
    sizes: list[int] = field(default_factory=list)  # number of elements of each sample
    digest: bytes = b""
    group: int | None = None


@dataclass(frozen=True)
class Object:
    """An object whose group has been written."""

    name: str
    metadata: str
    group: int
    digest: bytes


class AlembicWriter:
    """Writes an archive to an empty, seekable file.

    application: name of the writing program; frame_rate: of the scene [1/s], None for none.

    Methods raise OSError if the disk is full.
    """

    def __init__(self, file: BinaryIO, application: str, frame_rate: float | None = None) -> None:
        self._container = ogawa.OgawaWriter(file)
        rate = "" if frame_rate is None else f"{frame_rate:.6f}"
        self._metadata = {"_ai_Application": application, "FramesPerTimeUnit": rate}
        self._indices = {"": 0}  # of the metadata table
        self._samplings = [(1.0, 0.0)]  # (seconds between samples, time of the first [s])
        self._most_samples = [0]  # largest number of samples of each sampling

    def add_sampling(self, step: float, first: float) -> int:
        """Add a uniform time sampling with a step and a first time [s]; returns its index."""
        self._samplings.append((step, first))
        self._most_samples.append(0)
        return len(self._samplings) - 1

    def scalar(self, name: str, type: str, value: ArrayLike, metadata: Metadata | None = None) -> Property:
        """Write a scalar property of one sample: a number or a sequence of numbers."""
        elements = np.atleast_1d(np.asarray(value, TYPES[type][2]))
        result = Property(name, type, len(elements), serialized(metadata))
        self.add_sample(result, [elements])
        return result

    def array(self, name: str, type: str, values: ArrayLike, metadata: Metadata | None = None) -> Property:
        """Write an array property of one sample: (N,) or (N, extent) numbers."""
        elements = np.asarray(values, TYPES[type][2])
        extent = 1 if elements.ndim == 1 else elements.shape[1]
        result = Property(name, type, extent, serialized(metadata), is_array=True)
        self.add_sample(result, [elements])
        return result

    def strings(self, name: str, texts: Sequence[str], metadata: Metadata | None = None) -> Property:
        """Write an array property of one sample of str without null characters."""
        result = Property(name, "string", 1, serialized(metadata), is_array=True)
        self.add_sample(result, [_encoded(texts)], len(texts))
        return result

    def add_sample(self, target: Property, parts: Iterable[ogawa.Data], count: int | None = None) -> None:
        """Write the next sample of a property: the bytes of its elements, in parts; count: number of strings."""
        address, size, digest = self._container.sample(_bytes(parts))
        target.addresses.append(address)
        if target.type != "string":
            count = size // (target.extent * np.dtype(TYPES[target.type][2]).itemsize)
        target.sizes.append(1 if count is None else count)
        if target.is_array:
            # Readers derive numeric counts from the sample size.
            dimensions = struct.pack("<Q", target.sizes[-1]) if target.type == "string" else b""
            target.addresses.append(self._container.data(dimensions))
        target.digest = ogawa.digest_of(target.digest, digest)
        self._most_samples[target.sampling] = max(self._most_samples[target.sampling], len(target.sizes))

    def compound(self, name: str, properties: Sequence[Property], metadata: Metadata | None = None) -> Property:
        """Write a compound of properties whose samples are complete."""
        result = Property(name, "", 0, serialized(metadata))
        result.group, result.digest = self._write_properties(properties)
        return result

    def object(
        self, name: str, metadata: Metadata, properties: Sequence[Property], children: Sequence[Object] = ()
    ) -> Object:
        """Write an object; names of properties, and of children, must be unique."""
        written = serialized(metadata)
        group, digest = self._write_object(properties, children)
        return Object(name, written, group, ogawa.digest_of(digest, written.encode(), name.encode()))

    def close(self, children: Sequence[Object]) -> None:
        """Finish the archive with its top-level objects."""
        root, _digest = self._write_object([], children)
        version = f"Alembic {_LIBRARY_VERSION // 10000}.{_LIBRARY_VERSION // 100 % 100}.{_LIBRARY_VERSION % 100}"
        metadata = serialized({"_ai_AlembicVersion": version, **self._metadata})
        parts = [
            self._container.data(struct.pack("<i", _LAYOUT_VERSION)),
            self._container.data(struct.pack("<i", _LIBRARY_VERSION)),
            root,
            self._container.data(metadata.encode()),
            self._container.data(b"".join(self._packed_samplings())),
            self._container.data(b"".join(self._packed_table())),
        ]
        self._container.finish(self._container.group(parts))

    def _packed_samplings(self):
        for (step, first), most in zip(self._samplings, self._most_samples, strict=True):
            yield struct.pack("<IdId", most, step, 1, first)

    def _packed_table(self):
        for text in list(self._indices)[1:]:
            yield bytes([len(text.encode())]) + text.encode()

    def _write_object(self, properties, children):
        """Write an object's properties and children; returns (group, digest)."""
        own, own_digest = self._write_properties(properties)
        headers = b"".join(self._object_header(child) for child in children)
        of_children = ogawa.digest_of(*(child.digest for child in children)) if children else bytes(ogawa.DIGEST_SIZE)
        last = self._container.data(headers + own_digest + of_children)
        group = self._container.group([own, *(child.group for child in children), last])
        return group, ogawa.digest_of(of_children, own_digest)

    def _write_properties(self, properties):
        """Write a compound; returns (group, digest)."""
        groups = [p.group if p.group is not None else self._container.group(p.addresses) for p in properties]
        headers = [_property_header(p, self._index(p.metadata)) for p in properties]
        children = [*groups, self._container.data(b"".join(headers))] if properties else []
        digests = (part for p, header in zip(properties, headers, strict=True) for part in (header, p.digest))
        return self._container.group(children), ogawa.digest_of(*digests)

    def _object_header(self, child):
        name, metadata, index = child.name.encode(), child.metadata.encode(), self._index(child.metadata)
        in_full = struct.pack("<I", len(metadata)) + metadata if index == 0xFF else b""
        return struct.pack("<I", len(name)) + name + bytes([index]) + in_full

    def _index(self, metadata):
        """Return the index of metadata in the table, 0xff if it is written in full."""
        if len(metadata.encode()) > 0xFF or (metadata not in self._indices and len(self._indices) > _MOST_INDEXED):
            return 0xFF
        return self._indices.setdefault(metadata, len(self._indices))


def _property_header(header, index):
    """Return the bytes of a property's header.

    Bits 0 and 1: 0 compound, 1 scalar, 2 array, 3 array with one element in each sample; 2 and 3: size of the numbers
    that follow, 0 for 1 byte, 1 for 2, 2 for 4; 4 to 7: type; 8: own time sampling; 10: equal numbers of elements in
    all samples; 11: one sample only; 12 to 19: extent; 20 to 27: index of the metadata in the table.
    """
    name, metadata, count = header.name.encode(), header.metadata.encode(), len(header.sizes)
    largest = max(len(name), len(metadata), count, header.sampling)
    size = 0 if largest < 1 << 8 else 1 if largest < 1 << 16 else 2
    width = "<" + "BHI"[size]
    bits, numbers = size << 2 | index << 20, []
    if header.type:
        is_single = all(elements == 1 for elements in header.sizes)
        bits |= (2 | is_single) if header.is_array else 1
        bits |= TYPES[header.type][0] << 4 | header.extent << 12
        bits |= (header.sampling != 0) << 8 | (len(set(header.sizes)) <= 1) << 10 | (count <= 1) << 11
        numbers = [count, header.sampling] if header.sampling else [count]
    packed = [struct.pack(width, number) for number in (*numbers, len(name))]
    in_full = struct.pack(width, len(metadata)) + metadata if index == 0xFF else b""
    return struct.pack("<I", bits) + b"".join(packed) + name + in_full


def serialized(metadata: Metadata | None) -> str:
    """Return metadata in the file's form: sorted key=value pairs with semicolons between; empty values are omitted."""
    return ";".join(f"{key}={value}" for key, value in sorted((metadata or {}).items()) if value)


def _encoded(texts):
    """Return the bytes of null-terminated strings."""
    return b"".join(text.encode() + b"\0" for text in texts)


def _bytes(parts: Iterable[ogawa.Data]) -> Iterator[memoryview]:
    for part in parts:
        view = memoryview(np.ascontiguousarray(part) if isinstance(part, np.ndarray) else part)
        if view.nbytes:  # an empty view cannot be cast
            yield view.cast("B")
