# SPDX-License-Identifier: GPL-3.0-or-later
"""The manifest.json of a folder of simulated frames: the simulations of the frames, and the layout of the files."""

import dataclasses
import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import HairError
from ..geometry.affine import Affine
from ..params import is_text
from . import array_file, untrusted_file
from .atomic_file import atomic_file

NAME = "manifest.json"
FORMAT = "Vellus hair cache"
VERSION = 1

MOST_GUIDES = 1_000_000
MOST_POINTS = 257  # of a guide
MOST_FRAME = 99_999_999  # limit of eight digits in a file's name
MOST_KEYS = 64  # simulations with frames in one folder
STATES = ("baking", "part", "complete")

_LARGEST_FILE = 1_048_576  # bytes
_MOST_PARTS = 64
_MOST_NOTES = 1000
_MOST_LETTERS = 1000  # of a name or a reason
_DIGEST = 16  # bytes of a key, and of a digest
_STATE_BYTES_A_GUIDE = 32_768  # 65 vertices take 14,000


@dataclass(frozen=True)
class Manifest:
    """Description of the frames and files in a folder.

    keys: {part: digest} (`digests_of`) for each simulation with frames in the folder; the last one is baked now.
    guide_count, point_count: of each frame; state_layout: the arrays of a state; notes: (name, reason) of skipped
    objects; parted_by: digest of the partings between guides; spaces: for each key the matrix (16 numbers) from the
    guides' original coordinates to the coordinates of its frames, empty if all are the identity. Raises `HairError` for
    invalid values.
    """

    keys: tuple[Mapping[str, str], ...]
    guide_count: int
    point_count: int
    first: int
    last: int
    fps: float  # frames a second
    state: str = "part"  # from `STATES`
    state_layout: array_file.Layout = field(default_factory=dict)
    notes: tuple[tuple[str, str], ...] = ()
    parted_by: str = ""
    spaces: tuple[tuple[float, ...], ...] = ()

    def __post_init__(self) -> None:
        if not (0 < self.guide_count <= MOST_GUIDES and 2 <= self.point_count <= MOST_POINTS):
            raise HairError(
                "Frames of {guides} guides of {points} points cannot be cached.",
                guides=self.guide_count,
                points=self.point_count,
            )
        if not -MOST_FRAME <= self.first <= self.last <= MOST_FRAME:
            raise HairError("Frames {first} to {last} cannot be cached.", first=self.first, last=self.last)
        if not (math.isfinite(self.fps) and self.fps > 0.0) or self.state not in STATES:
            raise HairError("The cache's frame rate or state is invalid.")
        if not 0 < len(self.keys) <= MOST_KEYS or any(len(parts) > _MOST_PARTS for parts in self.keys):
            raise HairError("The cache holds frames of too many simulations: free it.")
        if len(self.spaces) not in {0, len(self.keys)} or not all(map(_is_space, self.spaces)):
            raise HairError("The cache's coordinates are invalid.")
        array_file.require_layout(self.state_layout)
        if len(self.state_layout) > _MOST_PARTS or not _MARKS.keys().isdisjoint(self.state_layout):
            raise HairError("The cache's states are invalid.")
        if array_file.size_of(self.state_layout) > (1 + self.guide_count) * _STATE_BYTES_A_GUIDE:
            raise HairError("The cache's states are too large.")

    @property
    def key(self) -> str:
        """Key of the simulation that is baked now."""
        return key_of(self.keys[-1])

    def space_of(self, key: str) -> tuple[float, ...]:
        """Return the matrix in `spaces` of a key's frames; the identity for an unknown key."""
        for parts, space in zip(self.keys, self.spaces, strict=False):
            if key_of(parts) == key:
                return space
        return UNMOVED

    @property
    def frame_layout(self) -> array_file.Layout:
        """The arrays of a frame's file."""
        points = ("<f4", (self.guide_count, self.point_count, 3))
        return {**_MARKS, "digest": ("|u1", (_DIGEST,)), "points": points}

    @property
    def state_file_layout(self) -> array_file.Layout:
        """The arrays of a state's file."""
        return {**_MARKS, **self.state_layout}

    def changed_parts(self, key: str) -> list[str] | None:
        """Return the parts that differ from a key's simulation: [] for the present key, None for an unknown one."""
        for parts in reversed(self.keys):
            if key_of(parts) == key:
                names = {*parts, *self.keys[-1]}
                return sorted(name for name in names if parts.get(name) != self.keys[-1].get(name))
        return None

    def continued(self, before: "Manifest") -> "Manifest":
        """Return this manifest for a folder with frames of an earlier manifest; frames of other keys become outdated.

        Raises `HairError` if the numbers of guides or points differ.
        """
        if (before.guide_count, before.point_count) != (self.guide_count, self.point_count):
            raise HairError("The cache has frames of other guides: free it, or bake to another folder.")
        others = [parts for parts in before.keys if key_of(parts) != self.key][1 - MOST_KEYS :]
        spaces = (*(before.space_of(key_of(parts)) for parts in others), self.space_of(self.key))
        spaces = () if set(spaces) == {UNMOVED} else spaces
        return dataclasses.replace(self, keys=(*others, self.keys[-1]), spaces=spaces)


UNMOVED = tuple(float(row == column) for row in range(4) for column in range(4))


def _is_space(numbers):
    return len(numbers) == 16 and Affine.of(numbers).is_valid


_MARKS = {"key": ("|u1", (_DIGEST,)), "frame": ("<i8", ())}


def digests_of(parts: Mapping[str, Any]) -> dict[str, str]:
    """Return {part: digest} of a simulation's inputs: arrays and JSON values."""
    return {name: digest(value) for name, value in parts.items()}


def key_of(digests: Mapping[str, str]) -> str:
    """Return the key of a simulation from the digests of its parts: 32 hexadecimal digits."""
    return digest(sorted(digests.items()))


def digest(value: Any) -> str:
    """Return a digest of 32 hexadecimal digits: of an array's type, shape and bits, or of a JSON value."""
    if isinstance(value, np.ndarray):
        little = np.ascontiguousarray(value, value.dtype.newbyteorder("<"))
        text = json.dumps([little.dtype.str, list(value.shape)]).encode() + b"\0" + little.tobytes()
    else:
        text = json.dumps(value, sort_keys=True).encode()
    return hashlib.blake2b(text, digest_size=_DIGEST).hexdigest()


def write(folder: Path, manifest: Manifest) -> None:
    """Write a folder's manifest atomically and flush it to disk. Raises `HairError`."""
    notes = [[part[:_MOST_LETTERS] for part in note] for note in manifest.notes[:_MOST_NOTES]]
    found = {"format": FORMAT, "version": VERSION} | dataclasses.asdict(manifest) | {"notes": notes}
    with atomic_file(folder / NAME) as partial:
        partial.write_text(json.dumps(found, indent=1), encoding="utf-8")


def read(folder: Path) -> Manifest:
    """Return the manifest of a folder. Raises `HairError` for content that `write` does not produce."""
    path = folder / NAME
    return parsed(untrusted_file.read(path, _LARGEST_FILE), path)


def parsed(data: bytes, path: Path) -> Manifest:
    """Return the manifest that bytes of a file contain; path: for error messages. Raises `HairError`."""
    try:
        found = json.loads(data.decode("utf-8"))
        if type(found) is not dict or (found.pop("format"), found.pop("version")) != (FORMAT, VERSION):
            raise ValueError("another program or version wrote it")
        found.setdefault("spaces", [])  # files of older versions have none
        if set(found) != {field.name for field in dataclasses.fields(Manifest)}:
            raise ValueError("entries are missing")
        return _from_json(found)
    except (ValueError, TypeError, KeyError, RecursionError) as error:
        raise HairError("{path} cannot be read: {cause}.", path=path, cause=str(error)[:200]) from error


def _from_json(found):
    for name in ("guide_count", "point_count", "first", "last"):
        _require(found[name], int)
    _require(found["state"], str)
    _require_text(found["parted_by"])
    if type(found["fps"]) is int:
        found["fps"] = float(found["fps"]) if abs(found["fps"]) < 2**53 else math.inf
    _require(found["fps"], float)
    keys = tuple(dict(_require(parts, dict)) for parts in _require(found["keys"], list))
    for parts in keys:
        for text in (*parts, *parts.values()):
            _require_text(text)
    layout = {name: _layout_entry(entry) for name, entry in _require(found["state_layout"], dict).items()}
    notes = [_note(note) for note in _require(found["notes"], list)[: _MOST_NOTES + 1]]
    if len(notes) > _MOST_NOTES:
        raise ValueError("there are too many notes")
    spaces = tuple(tuple(_number(part) for part in _require(one, list)) for one in _require(found["spaces"], list))
    read = {"keys": keys, "state_layout": layout, "notes": tuple(notes), "spaces": spaces}
    return Manifest(**(found | read))


def _number(value):
    return float(value) if type(value) is int and abs(value) < 2**53 else _require(value, float)


def _note(note):
    name, reason = _require(note, list)
    return _require_text(name), _require_text(reason)


def _layout_entry(entry):
    kind, shape = _require(entry, list)
    return _require(kind, str), tuple(_require(size, int) for size in _require(shape, list))


def _require_text(value):
    if len(_require(value, str)) > _MOST_LETTERS or not is_text(value):
        raise ValueError("a text is too long, or invalid")
    return value


def _require(value, kind):
    """Return a JSON value if it is exactly of a type (bool is not int). Raises TypeError."""
    if type(value) is not kind:
        raise TypeError(f"{str(value)[:40]!r} is not of type {kind.__name__}")
    return value
