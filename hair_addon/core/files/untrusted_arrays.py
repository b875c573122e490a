# SPDX-License-Identifier: GPL-3.0-or-later
"""Arrays of untrusted .npz files: no code is run, and damaged files raise `HairError`."""

import lzma
import math
import struct
import tokenize
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from ..errors import HairError, cause_of

# Exceptions of zipfile, its decompressors and NumPy's header parser for invalid bytes.
_OF_DAMAGE = (
    *(EOFError, LookupError, MemoryError, NotImplementedError, OverflowError, RuntimeError, SyntaxError, TypeError),
    *(ValueError, lzma.LZMAError, struct.error, tokenize.TokenError, zipfile.BadZipFile, zlib.error),
)


@contextmanager
def opened(path: Path) -> Iterator[zipfile.ZipFile]:
    """Yield an open archive of arrays. Invalid archives raise `HairError`, also within the context."""
    try:
        with open(path, "rb") as file, zipfile.ZipFile(file) as archive:
            yield archive
    except OSError as error:
        raise HairError("{path} cannot be read: {cause}.", path=path, cause=cause_of(error)) from error
    except _OF_DAMAGE as error:
        raise HairError("{path} cannot be read: {cause}.", path=path, cause=_cause(error)) from error


def names(archive: zipfile.ZipFile) -> list[str]:
    """Return the names of an archive's arrays."""
    return [name.removesuffix(".npy") for name in archive.namelist() if name.endswith(".npy")]


def header(archive: zipfile.ZipFile, name: str) -> tuple[tuple[int, ...], np.dtype]:
    """Return an array's shape and type from its header."""
    with archive.open(f"{name}.npy") as file:
        version = np.lib.format.read_magic(file)
        read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, _is_fortran, kind = read(file)
    return shape, kind


def array(archive: zipfile.ZipFile, name: str) -> np.ndarray:
    """Return an array of an archive. Raises ValueError if the declared size exceeds the size of the member."""
    shape, kind = header(archive, name)
    member = archive.getinfo(f"{name}.npy")
    if min(shape, default=0) < 0 or math.prod(shape) * kind.itemsize > member.file_size:
        raise ValueError("it is damaged")
    with archive.open(member) as file:
        return np.lib.format.read_array(file)  # no pickled objects, which could run code


def _cause(error):
    """Return the error's text if it is meant for people, else a general text."""
    if isinstance(error, zipfile.BadZipFile | RuntimeError | NotImplementedError) or type(error) is ValueError:
        return " ".join(str(error).split())[:200].rstrip(".") or "it is damaged"
    return "it is damaged"
