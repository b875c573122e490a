# SPDX-License-Identifier: GPL-3.0-or-later
"""Bytes of untrusted files of strands, and the error for damaged files.

Readers compare each count with the bytes that are left before they allocate memory for it.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from ...errors import HairError, cause_of


class Damaged(Exception):
    """A file contradicts its format; the text is the cause, without a period."""


@contextmanager
def bytes_of(path: Path) -> Iterator[bytes]:
    """Yield the bytes of a file. `Damaged` within the context, and errors of the disk, raise `HairError`."""
    try:
        with open(path, "rb") as file:
            data = file.read()
        with np.errstate(over="ignore", invalid="ignore"):
            yield data
    except OSError as error:
        raise HairError("{path} cannot be read: {cause}.", path=path, cause=cause_of(error)) from error
    except (Damaged, MemoryError) as error:
        raise HairError("{path} cannot be read: {cause}.", path=path, cause=str(error) or "memory is full") from error


def array(data: bytes, kind: str | np.dtype, count: int, place: int) -> np.ndarray:
    """Return `count` numbers of a NumPy type at a byte of a file. Raises `Damaged` if the file ends before them."""
    size = np.dtype(kind).itemsize * count
    if count < 0 or place < 0 or place + size > len(data):
        raise Damaged("it ends before its last strand")
    return np.frombuffer(data, kind, count, place)
