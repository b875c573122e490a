# SPDX-License-Identifier: GPL-3.0-or-later
"""Reading of small, untrusted files: plain files of limited size."""

import errno
import os
import stat
import time
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from ..errors import HairError, cause_of

T = TypeVar("T")

# On Windows, a program that reads a file, such as a virus scanner, briefly blocks others.
_PAUSES = (0.05, 0.2)  # [s] between attempts


def read(path: Path, most: int) -> bytes:
    """Return the bytes of a plain file of at most `most` bytes. Raises `HairError` for other files and for links.

    Opening does not block on a pipe; a larger file is not read.
    """
    flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0) | getattr(os, "O_NOFOLLOW", 0)

    def opened():
        if stat.S_ISLNK(os.lstat(path).st_mode):  # for systems without O_NOFOLLOW
            raise OSError(errno.ELOOP, "it is a link")
        return open(path, "rb", buffering=0, opener=lambda path, _flags: os.open(path, flags))

    try:
        with tried(opened) as file:
            status = os.fstat(file.fileno())
            if not stat.S_ISREG(status.st_mode):
                raise OSError(errno.EINVAL, "it is not a file")
            if status.st_size > most:
                raise OSError(errno.EFBIG, f"it is larger than {most} bytes")
            data = file.read(most + 1)
    except (OSError, ValueError) as error:  # ValueError: a character not allowed in file names
        raise HairError("{path} cannot be read: {cause}.", path=path, cause=cause_of(error)) from error
    if len(data) != status.st_size:
        raise HairError("{path} cannot be read: {cause}.", path=path, cause="it was changed meanwhile")
    return data


def tried(action: Callable[[], T]) -> T:
    """Return the result of an action on a file, repeated up to twice while another program holds the file."""
    for pause in _PAUSES:
        try:
            return action()
        except PermissionError:
            time.sleep(pause)
    return action()
