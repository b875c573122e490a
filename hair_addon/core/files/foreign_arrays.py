# SPDX-License-Identifier: GPL-3.0-or-later
"""Arrays of .npz files that anybody may have made: no code is run, and what is damaged is refused in a sentence."""

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

# What zipfile, its decompressors and NumPy's parser of headers raise for bytes that are no archive of arrays.
_OF_DAMAGE = (
    *(EOFError, LookupError, MemoryError, NotImplementedError, OverflowError, RuntimeError, SyntaxError, TypeError),
    *(ValueError, lzma.LZMAError, struct.error, tokenize.TokenError, zipfile.BadZipFile, zlib.error),
)


@contextmanager
def opened(path: Path) -> Iterator[zipfile.ZipFile]:
    """An archive of arrays. Raises `HairError` for whatever is wrong with it, also within the context."""
    try:
        with open(path, "rb") as file, zipfile.ZipFile(file) as archive:
            yield archive
    except OSError as error:
        raise HairError("{path} cannot be read: {cause}.", path=path, cause=cause_of(error)) from error
    except _OF_DAMAGE as error:
        raise HairError("{path} cannot be read: {cause}.", path=path, cause=_cause(error)) from error


def names(archive: zipfile.ZipFile) -> list[str]:
    """Names of the arrays of an archive."""
    return [name.removesuffix(".npy") for name in archive.namelist() if name.endswith(".npy")]


def header(archive: zipfile.ZipFile, name: str) -> tuple[tuple[int, ...], np.dtype]:
    """Shape and type of an array, as it states them."""
    with archive.open(f"{name}.npy") as file:
        version = np.lib.format.read_magic(file)
        read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, _is_fortran, kind = read(file)
    return shape, kind


def array(archive: zipfile.ZipFile, name: str) -> np.ndarray:
    """An array of an archive, which is as large as the archive says, so that no more memory is taken."""
    shape, kind = header(archive, name)
    member = archive.getinfo(f"{name}.npy")
    if min(shape, default=0) < 0 or math.prod(shape) * kind.itemsize > member.file_size:
        raise ValueError("it is damaged")
    with archive.open(member) as file:
        return np.lib.format.read_array(file)  # no objects, which could be code


def _cause(error):
    """A line of the error where it is a sentence for people."""
    if isinstance(error, zipfile.BadZipFile | RuntimeError | NotImplementedError) or type(error) is ValueError:
        return " ".join(str(error).split())[:200].rstrip(".") or "it is damaged"
    return "it is damaged"
