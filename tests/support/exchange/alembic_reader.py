# SPDX-License-Identifier: GPL-3.0-or-later
"""An independent reader of Alembic files in Ogawa, which shares no code with the writer.

It asserts all rules of the format; positions, sizes and counts first.
"""

import struct
from dataclasses import dataclass, field

import numpy as np

KINDS = {
    0: ("bool_t", "?"),
    1: ("uint8_t", "u1"),
    2: ("int8_t", "i1"),
    3: ("uint16_t", "<u2"),
    4: ("int16_t", "<i2"),
    5: ("uint32_t", "<u4"),
    6: ("int32_t", "<i4"),
    10: ("float32_t", "<f4"),
    11: ("float64_t", "<f8"),
    12: ("string", None),
}
DATA = 1 << 63


@dataclass
class Property:
    """form: compound, scalar or array; samples: arrays, or lists of str; times: of the samples [s]."""

    form: str
    metadata: dict
    kind: str = ""
    extent: int = 0
    samples: list = field(default_factory=list)
    times: list = field(default_factory=list)
    children: dict = field(default_factory=dict)

    @property
    def scope(self):
        return {"con": "constant", "uni": "uniform", "vtx": "vertex"}[self.metadata["geoScope"]]

    @property
    def only(self):
        (sample,) = self.samples
        return sample


@dataclass
class Object:
    metadata: dict
    properties: dict
    children: dict


@dataclass
class Archive:
    metadata: dict
    objects: dict
    samplings: list  # (most samples, seconds between samples, times)


def read(path):
    """Return the `Archive` of a file."""
    return _Reader(path.read_bytes()).archive()


def objects(archive):
    """Return {path: Object} of a whole archive."""

    def below(children, path):
        for name, child in children.items():
            yield f"{path}/{name}", child
            yield from below(child.children, f"{path}/{name}")

    return dict(below(archive.objects, ""))


class _Reader:
    def __init__(self, data):
        self.data = data
        self.seen = set()

    def archive(self):
        assert self.data[:5] == b"Ogawa" and self.data[5] == 0xFF and self.data[6:8] == b"\x00\x01"
        (root,) = struct.unpack_from("<Q", self.data, 8)
        children = self.group(root)
        assert len(children) == 6 and [bool(child & DATA) for child in children] == [
            True,
            True,
            False,
            True,
            True,
            True,
        ]
        assert self.content(children[0]) == struct.pack("<i", 0)
        (library,) = struct.unpack("<i", self.content(children[1]))
        assert 10000 <= library < 20000
        self.samplings = self.read_samplings(self.content(children[4]))
        self.table = [{}, *self.read_table(self.content(children[5]))]
        top = self.object(children[2], {})
        return Archive(metadata(self.content(children[3])), top.children, self.samplings)

    def group(self, address):
        if address == 0:
            return []
        assert not address & DATA and 16 <= address <= len(self.data) - 8
        (count,) = struct.unpack_from("<Q", self.data, address)
        assert 0 < count <= (len(self.data) - address - 8) // 8
        return list(struct.unpack_from(f"<{count}Q", self.data, address + 8))

    def content(self, address):
        assert address & DATA
        place = address & ~DATA
        if place == 0:
            return b""
        assert 16 <= place <= len(self.data) - 8
        (size,) = struct.unpack_from("<Q", self.data, place)
        assert 0 < size <= len(self.data) - place - 8
        return self.data[place + 8 : place + 8 + size]

    def read_samplings(self, content):
        found, place = [], 0
        while place < len(content):
            most, step, count = struct.unpack_from("<IdI", content, place)
            assert count >= 1
            times = struct.unpack_from(f"<{count}d", content, place + 16)
            found.append((most, step, times))
            place += 16 + 8 * count
        assert found[0][1:] == (1.0, (0.0,))
        return found

    def read_table(self, content):
        place = 0
        while place < len(content):
            size = content[place]
            yield metadata(content[place + 1 : place + 1 + size])
            place += 1 + size

    def object(self, address, own_metadata):
        children = self.group(address)
        headers = self.content(children[-1])
        assert len(headers) >= 32
        headers, place, names = headers[:-32], 0, []
        while place < len(headers):
            (size,) = struct.unpack_from("<I", headers, place)
            name = headers[place + 4 : place + 4 + size].decode()
            index, place = headers[place + 4 + size], place + 5 + size
            if index == 0xFF:
                (size,) = struct.unpack_from("<I", headers, place)
                found = metadata(headers[place + 4 : place + 4 + size])
                place += 4 + size
            else:
                found = self.table[index]
            names.append((name, found))
        assert len(names) == len(children) - 2 and len({name for name, _ in names}) == len(names)
        below = {name: self.object(child, m) for (name, m), child in zip(names, children[1:-1], strict=True)}
        return Object(own_metadata, self.compound(children[0]), below)

    def compound(self, address):
        children = self.group(address)
        if not children:
            return {}
        headers, place, found = self.content(children[-1]), 0, {}
        for child in children[:-1]:
            (bits,) = struct.unpack_from("<I", headers, place)
            place += 4
            number = "<" + "BHI"[bits >> 2 & 3]

            def take(number=number):
                nonlocal place
                (value,) = struct.unpack_from(number, headers, place)
                place += struct.calcsize(number)
                return value

            count = sampling = 0
            changes = None  # first and last sample that differs from the previous one
            if bits & 3:
                count = take()
                changes = (take(), take()) if bits & 0x200 else (0, 0) if bits & 0x800 else (1, count - 1)
                assert 0 <= changes[0] <= changes[1] < max(count, 1)
                sampling = take() if bits & 0x100 else 0
            size = take()
            name = headers[place : place + size].decode()
            place += size
            index = bits >> 20 & 0xFF
            if index == 0xFF:
                size = take()
                found_metadata = metadata(headers[place : place + size])
                place += size
            else:
                found_metadata = self.table[index]
            assert name and name not in found
            found[name] = self.property(child, bits, count, changes, sampling, found_metadata)
        assert place == len(headers)
        return found

    def property(self, address, bits, count, changes, sampling, found_metadata):
        form = ("compound", "scalar", "array", "array")[bits & 3]
        if form == "compound":
            return Property(form, found_metadata, children=self.compound(address))
        kind, dtype = KINDS[bits >> 4 & 0xF]
        extent = bits >> 12 & 0xFF
        children = self.group(address)
        first, last = changes
        held = [0 if n < first or last == 0 else min(n, last) - first + 1 for n in range(count)]
        assert len(children) == len({*held}) * (2 if form == "array" else 1)
        contents = children[::2] if form == "array" else children
        written = [self.sample(child, dtype, extent) for child in contents]
        sizes = {len(sample) for sample in written}
        if form == "array":
            assert (bits & 3 == 3) == (sizes == {1})
            for sample, dimensions in zip(written, children[1::2], strict=True):
                wanted = struct.pack("<Q", len(sample)) if dtype is None else b""
                assert self.content(dimensions) == wanted
        else:
            assert sizes == {1}
        samples = [written[index] for index in held]
        most, step, times = self.samplings[sampling]
        assert len({*held}) <= most
        return Property(form, found_metadata, kind, extent, samples, [times[0] + step * n for n in range(count)])

    def sample(self, address, dtype, extent):
        """Return an array (N,) or (N, extent), or a list of str."""
        content = self.content(address)
        assert not content or (len(content) > 16 and any(content[:16])), "no digest"
        content = content[16:]
        if dtype is None:
            assert not content or content.endswith(b"\0")
            return content[:-1].decode().split("\0") if content else []
        values = np.frombuffer(content, dtype)
        assert len(values) % extent == 0
        return values if extent == 1 else values.reshape(-1, extent)


def metadata(content):
    text = content.decode()
    return dict(entry.split("=", 1) for entry in text.split(";")) if text else {}
