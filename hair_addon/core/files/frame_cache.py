# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames of simulated guides in a folder, and the states from which a simulation continues.

A folder has a marker of ownership, a manifest (frame_manifest.py), `+00000123.npz` for each frame and
`state_+00000120.npz` for some frames. Files are written atomically; a file that does not match the manifest's layout
counts as a missing frame. Nothing is written to a foreign folder or through a link. Only files with these names, in a
folder of ours, are ever removed.
"""

import contextlib
import os
import re
import secrets
from collections.abc import Generator, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..errors import HairError, cause_of
from ..geometry.affine import Affine
from . import array_file, frame_manifest, untrusted_file
from .atomic_file import atomic_file
from .file_lock import claim, claim_of
from .frame_manifest import Manifest

_NAME = re.compile(r"(state_)?([+-](?!0{8})[0-9]{8}|\+0{8})\.npz", re.ASCII)  # frame 0 has one name
# Partial files of a killed process, as `atomic_file` names them; eight digits in older versions.
_LEFT_OVER = re.compile(r"\.vellus_[0-9a-f]{8}(?:[0-9a-f]{8})?\.(npz|json)", re.ASCII)
MARKER = ".vellus_cache"  # the file that marks a folder as ours
_MARK = b"Baked frames of Vellus\n"
_IDENTITY = re.compile(r"[0-9a-f]{16}", re.ASCII)


@dataclass(frozen=True)
class Frame:
    """One frame: points (G, P, 3) float32 [m] of the guides, on the surface at rest.

    key: of the simulation; digest: of the animation (`frame_manifest.digest`); is_carried: whether points were
    transformed because the guides' coordinates have changed since they were simulated.
    """

    points: np.ndarray
    key: str
    digest: str
    is_carried: bool = False


def new_identity() -> str:
    """Return 16 random hexadecimal digits that identify the cache folder of some guides."""
    return secrets.token_hex(8)


def folder_of(base: Path, identity: str) -> Path:
    """Return the folder of some guides' frames. Raises `HairError` for an invalid identity."""
    if not _IDENTITY.fullmatch(identity):
        raise HairError("The guides have no valid cache: free it, and bake again.")
    return base / identity


class FrameCache:
    """Reader of frames in a folder. Unreadable files count as missing; `take_errors` returns the reasons once."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._reported: set[str] = set()
        self._complaints: list[HairError] = []
        self._checked: dict[int, tuple[tuple[int, ...], HairError | None]] = {}  # frame → (file's stamp, its fault)
        self.manifest: Manifest | None = None
        self.space = Affine.identity()  # from the guides' original to their present coordinates
        self.read_manifest()

    def read_manifest(self) -> Manifest | None:
        """Return the manifest, read again from disk; None if it is missing or invalid."""
        try:
            self.manifest = frame_manifest.read(self.folder)
        except HairError as error:
            self.manifest = None
            if os.path.lexists(self.folder / frame_manifest.NAME):
                self._complain(frame_manifest.NAME, error)
        return self.manifest

    def frame_numbers(self) -> list[int]:
        """Return the sorted numbers of existing frame files, without reading them."""
        return _numbers(self.folder, False)

    def state_numbers(self) -> list[int]:
        """Return the sorted numbers of the frames with an existing state file."""
        return _numbers(self.folder, True)

    def fault_of(self, number: int) -> HairError | None:
        """Return why the file of a frame is invalid; None if it is valid or missing.

        A file is read again only after it has changed.
        """
        stamp, known = _stamp_of(self.folder / _name(number, False)), self._checked.get(number)
        if stamp is None:
            return None
        if known is None or known[0] != stamp:
            read_with = self.manifest
            is_whole = self._frame_arrays(number) is not None
            if not is_whole and self.read_manifest() != read_with:  # another process has baked since
                self._frame_arrays(number)
            known = self._checked.get(number)
        return None if known is None else known[1]

    def read_frame(self, number: int) -> Frame | None:
        """Return a frame of any simulation in the manifest, None for a missing one."""
        if self.manifest is None:
            return None
        arrays = self._frame_arrays(number)
        if arrays is None:
            return None
        key = arrays["key"].tobytes().hex()
        change = self.space @ Affine.of(self.manifest.space_of(key)).inverse
        points, digest = change.points(arrays["points"]), arrays["digest"].tobytes().hex()
        return Frame(points, key, digest, not change.is_identity)

    def read_state(self, number: int) -> dict[str, np.ndarray] | None:
        """Return the arrays of the state after a frame of the present simulation, None for a missing one."""
        if self.manifest is None:
            return None
        name = _name(number, True)
        arrays = self._read(self.manifest, name, self.manifest.state_file_layout, number)
        if arrays is None:
            return None
        if arrays.pop("key").tobytes().hex() != self.manifest.key:
            self._complain(name, HairError("{path} is a state of another simulation.", path=self.folder / name))
            return None
        arrays.pop("frame")
        return arrays

    def points_at(self, time: float) -> np.ndarray | None:
        """Return points (G, P, 3) float32 [m] at a time in frames, maybe a fraction; None if a frame is missing.

        Interpolation is cubic through four frames, linear if one of the outer two is missing.
        """
        number = int(np.floor(time))
        frame = self.read_frame(number)
        if frame is None or time == number:
            return None if frame is None else frame.points
        there = set(self.frame_numbers())
        others = [self.read_frame(n) if n in there else None for n in (number - 1, number + 1, number + 2)]
        before, after, last = (None if other is None else other.points for other in others)
        return None if after is None else between(before, frame.points, after, last, time - number)

    def take_errors(self) -> list[HairError]:
        """Return the reasons why files could not be read, and clear them."""
        taken, self._complaints = self._complaints, []
        return taken

    def _read(self, manifest, name, layout, number):
        path = self.folder / name
        if not os.path.lexists(path):
            return None
        try:
            return _arrays(path, manifest, layout, number)
        except HairError as error:
            self._complain(name, error)
            return None

    def _frame_arrays(self, number):
        """Return the arrays of a frame's file or None; stores the file's fault for `fault_of`."""
        path = self.folder / _name(number, False)
        stamp, fault = _stamp_of(path), None
        if stamp is None or self.manifest is None:
            return None
        try:
            return _arrays(path, self.manifest, self.manifest.frame_layout, number)
        except HairError as error:
            fault = error
            self._complain(path.name, error)
            return None
        finally:
            self._checked[number] = stamp, fault

    def _complain(self, name, error):
        if name not in self._reported:
            self._reported.add(name)
            self._complaints.append(error)


class Writer:
    """Writes frames to a folder that this process has claimed; `baking` creates it."""

    def __init__(self, folder: Path, manifest: Manifest) -> None:
        self.folder, self.manifest = folder, manifest
        self._is_complete = False

    def write_frame(self, number: int, points: np.ndarray, digest: str) -> None:
        """Write a frame atomically, with `Frame`'s points and digest. Raises `HairError`."""
        arrays = self._marked(number) | {"digest": _bytes_of(digest), "points": points.astype(np.float32, copy=False)}
        self._write(_name(number, False), arrays, self.manifest.frame_layout, False)

    def write_state(self, number: int, arrays: Mapping[str, np.ndarray]) -> None:
        """Write the state after a frame, from which the simulation can continue, and flush it to disk."""
        self._write(_name(number, True), {**self._marked(number), **arrays}, self.manifest.state_file_layout, True)

    def remove_states(self, after: int) -> None:
        """Remove the states after a frame: another simulation may give other states. Raises `HairError`."""
        try:
            _remove(self.folder, lambda name: (found := _NAME.fullmatch(name)) and found[1] and int(found[2]) > after)
        except OSError as error:
            raise HairError("{path} cannot be written: {cause}.", path=self.folder, cause=cause_of(error)) from error

    def change(self, **changes: object) -> None:
        """Change entries of the manifest, such as notes."""
        changed = replace(self.manifest, **changes)  # type: ignore[bad-argument-type]
        frame_manifest.write(self.folder, changed)
        self.manifest = changed

    def complete(self) -> None:
        """Mark all frames as written."""
        self._is_complete = True

    def end(self) -> None:
        """Write to the manifest whether baking is complete. Called by `baking`."""
        with contextlib.suppress(HairError):  # the folder is gone or the disk is full: equivalent to a killed process
            if self.folder.is_dir():
                self.change(state="complete" if self._is_complete else "part")

    def _marked(self, number):
        return {"key": _bytes_of(self.manifest.key), "frame": np.array(number, np.int64)}

    def _write(self, name, arrays, layout, is_forced):
        path = self.folder / name
        if array_file.layout_of(arrays) != dict(layout):
            raise HairError("{path} cannot be written: {cause}.", path=path, cause="its arrays are not the manifest's")
        if not (self.folder / frame_manifest.NAME).is_file():
            raise HairError("{path} cannot be written: {cause}.", path=path, cause="its folder has lost its manifest")
        with atomic_file(path, is_forced=is_forced) as partial:
            array_file.write(partial, arrays)


@contextlib.contextmanager
def baking(folder: Path, manifest: Manifest) -> Generator[Writer]:
    """Claim a folder, created if missing, and yield the `Writer` of its frames. Existing frames are kept.

    Raises `HairError` if another process bakes to the folder, if it cannot be written, or if it has frames of other
    guides. On exit the manifest is updated to state whether the frames are complete.
    """
    with contextlib.ExitStack() as stack:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            _require_own(folder)
            is_ours = stack.enter_context(claim(folder / frame_manifest.NAME))
            if is_ours:
                _mark(folder)
                _remove(folder, _LEFT_OVER.fullmatch)
        except (OSError, ValueError) as error:  # ValueError: a character not allowed in file names
            raise HairError("{path} cannot be written: {cause}.", path=folder, cause=cause_of(error)) from error
        if not is_ours:
            raise HairError("{path} is being baked by another process.", path=folder)
        before = FrameCache(folder).manifest
        writer = Writer(folder, manifest if before is None else manifest.continued(before))
        writer.change(state="baking")
        stack.callback(writer.end)
        yield writer


def remove(folder: Path, numbers: Iterable[int] | None = None) -> int:
    """Remove frames and states of the given numbers, or all with the manifest. Returns the number of files removed.

    Nothing is removed from a folder without a valid manifest, through a link, or while another process bakes. Raises
    `HairError`.
    """
    frame_manifest.read(folder)
    wanted = None if numbers is None else set(numbers)
    try:
        if folder.is_symlink():
            raise HairError("{path} is a link: nothing was removed.", path=folder)
        with claim(folder / frame_manifest.NAME) as is_ours:
            if not is_ours:
                raise HairError("{path} is being baked by another process.", path=folder)
            if wanted is not None:
                return _remove(folder, lambda name: (found := _NAME.fullmatch(name)) and int(found[2]) in wanted)
            count = _remove(folder, lambda name: _NAME.fullmatch(name) or _LEFT_OVER.fullmatch(name))
            _remove(folder, lambda name: name == frame_manifest.NAME)
    except OSError as error:
        raise HairError("{path} cannot be removed: {cause}.", path=folder, cause=cause_of(error)) from error
    with contextlib.suppress(OSError):
        if set(os.listdir(folder)) <= {MARKER}:  # with other files in it, the folder stays
            _remove(folder, lambda name: name == MARKER)
            folder.rmdir()
    return count


def is_marked(folder: Path) -> bool:
    """Return whether a folder has our marker: a plain file with the right content."""
    try:
        return untrusted_file.read(folder / MARKER, len(_MARK)) == _MARK
    except HairError:
        return False


def _require_own(folder):
    """Raise `HairError` unless a folder is ours or empty, and not a link."""
    if folder.is_symlink():
        raise HairError("{path} is a link: remove it, or choose another cache folder.", path=folder)
    if is_marked(folder):
        return
    own = {claim_of(folder / frame_manifest.NAME).name}
    if all(name in own or _LEFT_OVER.fullmatch(name) for name in os.listdir(folder)):
        return
    try:
        frame_manifest.read(folder)  # folders of older versions have no marker
    except HairError as error:
        sentence = "{path} has files of another program: move them, or choose another cache folder."
        raise HairError(sentence, path=folder) from error


def _mark(folder):
    """Write our marker to a folder that this process has claimed. Raises OSError."""
    _require_own(folder)
    if is_marked(folder):
        return
    flags = os.O_CREAT | os.O_EXCL | os.O_WRONLY | getattr(os, "O_BINARY", 0)  # does not follow links
    with os.fdopen(os.open(folder / MARKER, flags, 0o666), "wb") as file:
        file.write(_MARK)


def between(
    before: np.ndarray | None, start: np.ndarray, end: np.ndarray, after: np.ndarray | None, part: float
) -> np.ndarray:
    """Return points, float32, interpolated at a fraction `part` in [0, 1] of the time from frame start to frame end.

    The frames are consecutive. Interpolation is cubic through all four frames, exact for cubic motion; linear if
    `before` or `after` is None.
    """
    t = float(part)
    if before is None or after is None:
        return np.float32(1.0 - t) * start + np.float32(t) * end
    # Lagrange's polynomials for the times -1, 0, 1 and 2.
    weights = (
        -t * (t - 1.0) * (t - 2.0) / 6.0,
        (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0,
        -(t + 1.0) * t * (t - 2.0) / 2.0,
        (t + 1.0) * t * (t - 1.0) / 6.0,
    )
    a, b, c, d = map(np.float32, weights)
    return a * before + b * start + c * end + d * after


def _stamp_of(path):
    """Return a stamp that changes whenever a file is written; None for a missing file."""
    try:
        status = path.lstat()
    except OSError:
        return None
    return status.st_ino, status.st_size, status.st_mtime_ns, status.st_ctime_ns


def _arrays(path, manifest, layout, number):
    """Return the arrays of a frame's or a state's file. Raises `HairError`."""
    arrays = array_file.read(path, layout)
    if int(arrays["frame"]) != number or manifest.changed_parts(arrays["key"].tobytes().hex()) is None:
        raise HairError("{path} is a frame of another simulation.", path=path)
    return arrays


def _name(number, is_state):
    return f"{'state_' if is_state else ''}{number:+09d}.npz"


def _bytes_of(digits):
    return np.frombuffer(bytes.fromhex(digits), np.uint8)


def _numbers(folder, is_state):
    try:
        found = [_NAME.fullmatch(name) for name in os.listdir(folder)]
    except OSError:
        return []
    return sorted(int(match[2]) for match in found if match and bool(match[1]) == is_state)


def _remove(folder, is_chosen):
    """Remove the plain files of a folder whose names `is_chosen`; returns the number of files removed."""
    with os.scandir(folder) as entries:
        chosen = [entry.path for entry in entries if is_chosen(entry.name) and entry.is_file(follow_symlinks=False)]
    for path in chosen:
        untrusted_file.tried(lambda path=path: os.unlink(path))
    return len(chosen)
