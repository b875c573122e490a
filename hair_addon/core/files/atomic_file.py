# SPDX-License-Identifier: GPL-3.0-or-later
"""Atomic writing of files: a temporary file is written beside the target, and replaces the target at the end."""

import contextlib
import os
import re
import secrets
from collections.abc import Generator, Iterable
from pathlib import Path

from ..errors import HairError, cause_of
from . import untrusted_file

_PARTIAL = re.compile(r"\.vellus_[0-9a-f]{16}_(.+)", re.ASCII | re.DOTALL)


@contextlib.contextmanager
def atomic_file(path: str | Path, partial: Path | None = None, is_forced: bool = True) -> Generator[Path]:
    """Yield a temporary path, like `atomic_files`, for one file; partial: the temporary path, None for a new path."""
    with atomic_files([path], None if partial is None else [partial], is_forced) as (there,):
        yield there


@contextlib.contextmanager
def atomic_files(
    paths: Iterable[str | Path], partials: list[Path] | None = None, is_forced: bool = True
) -> Generator[list[Path]]:
    """Yield temporary paths to write to; the files replace `paths` on success, and are removed after an error.

    partials: the temporary paths, None for new paths. Raises `HairError` if a folder cannot be written or the disk is
    full. is_forced: whether files are flushed to disk before they are moved; some exporters do not report a full disk.
    """
    places = [Path(path) for path in paths]
    for path in places:
        _require_file(path)
    # In the same folder, because files may contain relative paths.
    partials = partials or [new_partial_of(path) for path in places]
    try:
        for path in places:
            path.parent.mkdir(parents=True, exist_ok=True)
        yield partials
        for path, partial in zip(places, partials, strict=True):
            if not (partial.is_file() and partial.stat().st_size):
                raise HairError(f"{path} was not written: its exporter left no file, or an empty one.")
        if is_forced:
            require_room(partial, 65_536)
        for path, partial in zip(places, partials, strict=True):
            untrusted_file.tried(lambda partial=partial, path=path: os.replace(partial, path))
    except (OSError, RuntimeError) as error:
        raise HairError("{path} cannot be written: {cause}.", path=places[0], cause=cause_of(error)) from error
    finally:
        for partial in partials:
            with contextlib.suppress(OSError):  # moved to its place, or never created
                partial.unlink()


def new_partial_of(path: Path) -> Path:
    """Return an unpredictable temporary path beside a file, so that no link can be placed there in advance."""
    return path.with_name(f".vellus_{secrets.token_hex(8)}{path.suffix}")


def partial_of(path: Path) -> Path:
    """Return an unpredictable temporary path for a claimed file; `leftovers` finds it if the process is killed."""
    return path.with_name(f".vellus_{secrets.token_hex(8)}_{path.name}")


def leftovers(folder: Path) -> dict[str, list[Path]]:
    """Return {file name: its temporary files from `partial_of`} in a folder; {} if it cannot be listed."""
    found: dict[str, list[Path]] = {}
    with contextlib.suppress(OSError):
        for name in sorted(os.listdir(folder)):
            named = _PARTIAL.fullmatch(name)
            if named:
                found.setdefault(named[1], []).append(folder / name)
    return found


def require_room(path: Path, byte_count: int) -> None:
    """Raise OSError unless a file can grow by `byte_count`; creates a missing file, changes no content."""
    with open(path, "ab") as file:
        size = file.seek(0, os.SEEK_END)
        try:
            for start in range(0, byte_count, 2**20):
                file.write(bytes(min(2**20, byte_count - start)))
            file.flush()
            os.fsync(file.fileno())
        finally:
            file.truncate(size)


def require_writable_path(path: str | Path) -> None:
    """Raise `HairError` unless a file can be written at `path`; for use before long work."""
    path = Path(path)
    _require_file(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        partial = path.with_name(f".vellus_{secrets.token_hex(8)}")
        os.close(os.open(partial, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))  # does not follow links
        partial.unlink()
    except OSError as error:
        raise HairError("{path} cannot be written: {cause}.", path=path, cause=cause_of(error)) from error


def _require_file(path):
    """Raise `HairError` if a path exists and is not a file: writing would replace a device."""
    try:
        is_taken = path.stat() and not path.is_file()
    except FileNotFoundError:
        return
    except (OSError, ValueError) as error:  # ValueError: a character not allowed in file names
        raise HairError("{path} cannot be written: {cause}.", path=path, cause=cause_of(error)) from error
    if is_taken:
        raise HairError("{path} cannot be written: {cause}.", path=path, cause="it is a folder or a device")
