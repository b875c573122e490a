# SPDX-License-Identifier: GPL-3.0-or-later
"""Elements of PLY files [Turk94] as arrays: ASCII, little- and big-endian, with lists."""

from dataclasses import dataclass, field

import numpy as np

from . import contents
from .contents import Damaged

_MOST_HEADER = 65_536
_END = b"end_header"
_TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


@dataclass
class Element:
    """An element of a header with `count` rows.

    properties: name → type; lists: name → (type of the length, type of the items); values: name → array (count,);
    items: name of a list → (all items, lengths (count,)).
    """

    name: str
    count: int
    properties: dict[str, str] = field(default_factory=dict)
    lists: dict[str, tuple[str, str]] = field(default_factory=dict)
    order: list[str] = field(default_factory=list)
    values: dict[str, np.ndarray] = field(default_factory=dict)
    items: dict[str, tuple[np.ndarray, np.ndarray]] = field(default_factory=dict)


def parsed(data: bytes) -> tuple[dict[str, Element], list[str]]:
    """Return ({name: `Element`}, comments) of a file's bytes. Raises `Damaged`."""
    head = data[:_MOST_HEADER].find(_END)
    stop = data.find(b"\n", head) + 1
    if not data.startswith(b"ply") or head < 0 or not stop:
        raise Damaged("it is not a PLY file")
    order, elements, comments = _header(data[:head].decode("ascii", "replace"))
    if order is None:
        raise Damaged("its format is not known")
    rest = _Words(data[stop:].split()) if order == "" else _Bytes(data, stop, order)
    for element in elements:
        rest.read(element)
    return {element.name: element for element in elements}, comments


def _header(text):
    order, elements, comments = None, [], []
    for line in text.splitlines():
        words = line.split()
        kind = words[0] if words else ""
        if kind == "format" and len(words) == 3:
            order = _ORDERS.get(words[1])
        elif kind == "comment":
            comments.append(line.removeprefix("comment").strip())
        elif kind == "element" and len(words) == 3 and words[2].isdecimal() and len(words[2]) < 12:
            elements.append(Element(words[1], int(words[2])))
        elif kind == "property" and elements:
            _add_property(elements[-1], words[1:])
        elif kind in ("element", "property"):
            raise Damaged("its header is damaged")
    return order, elements, comments


def _add_property(element, words):
    is_list = words[:1] == ["list"]
    kinds = [_TYPES[word] for word in (words[1:3] if is_list else words[:1]) if word in _TYPES]
    if (
        len(words) != (4 if is_list else 2)
        or len(kinds) != len(words) - (2 if is_list else 1)
        or words[-1] in element.order
    ):
        raise Damaged("its header is damaged")
    element.order.append(words[-1])
    if is_list:
        if kinds[0][0] == "f":
            raise Damaged("its header is damaged")
        element.lists[words[-1]] = kinds[0], kinds[1]
    else:
        element.properties[words[-1]] = kinds[0]


class _Bytes:
    """The rest of a binary file."""

    def __init__(self, data, place, order):
        self._data, self._place, self._order = data, place, order

    def read(self, element):
        if not element.order:
            return
        if not element.lists:
            kind = np.dtype([(name, self._order + element.properties[name]) for name in element.order])
            rows = contents.array(self._data, kind, element.count, self._place)
            self._place += kind.itemsize * element.count
            element.values = {name: rows[name] for name in element.order}
            return
        kinds = {name: self._order + kind for name, kind in element.properties.items()}
        kinds |= {name: self._order + length for name, (length, _kind) in element.lists.items()}
        least = sum(np.dtype(kind).itemsize for kind in kinds.values())
        if element.count * least > len(self._data) - self._place:
            raise Damaged("it ends before its last strand")
        found = {name: [] for name in element.order}
        for _row in range(element.count):
            for name in element.order:
                (value,) = self._take(kinds[name], 1)
                if name in element.lists:
                    value = self._take(self._order + element.lists[name][1], int(value))
                found[name].append(value)
        _keep(element, found)

    def _take(self, kind, count):
        values = contents.array(self._data, kind, count, self._place)
        self._place += values.nbytes
        return values


class _Words:
    """The rest of an ASCII file."""

    def __init__(self, words):
        self._words, self._place = words, 0

    def read(self, element):
        if not element.order:
            return
        if not element.lists:
            width = len(element.order)
            rows = self._numbers(width * element.count).reshape(-1, width)
            element.values = {name: rows[:, column] for column, name in enumerate(element.order)}
            return
        if element.count * len(element.order) > len(self._words) - self._place:
            raise Damaged("it ends before its last strand")
        found = {name: [] for name in element.order}
        for _row in range(element.count):
            for name in element.order:
                (value,) = self._numbers(1)
                if name in element.lists:
                    if not 0 <= value <= len(self._words):
                        raise Damaged("it ends before its last strand")
                    value = self._numbers(int(value))
                found[name].append(value)
        _keep(element, found)

    def _numbers(self, count):
        words = self._words[self._place : self._place + count]
        if len(words) != count:
            raise Damaged("it ends before its last strand")
        self._place += count
        try:
            return np.array([float(word) for word in words], np.float64)
        except ValueError as error:
            raise Damaged("a number of it is damaged") from error


def _keep(element, found):
    for name, rows in found.items():
        if name in element.lists:
            items = np.concatenate(rows) if rows else np.zeros(0)
            element.items[name] = items, np.array([len(row) for row in rows], np.int64)
        else:
            element.values[name] = np.array(rows)
