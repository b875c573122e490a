# SPDX-License-Identifier: GPL-3.0-or-later
"""File locks that assign a file to one of several processes, on one machine or on several.

A claim is a lock on a file beside the file to be written. The operating system releases the lock when the process ends,
even if it is killed.
"""

import contextlib
import errno
import os
import stat
import sys
from collections.abc import Generator
from pathlib import Path

if sys.platform == "win32":
    import msvcrt
else:
    import fcntl

_HELD = {errno.EACCES, errno.EAGAIN, errno.EDEADLK, errno.EWOULDBLOCK}
# Links are not followed, and opening a pipe does not block: the folder is untrusted.
_NEVER_ELSEWHERE = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
_NO_LOCKS = {errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP, errno.ENOTSUP, errno.EINVAL}


@contextlib.contextmanager
def claim(path: str | Path) -> Generator[bool]:
    """Claim a file for the duration of the context; yields False if another process has claimed it.

    On file systems without locks every claim succeeds: work is then duplicated, but each file is still complete. Raises
    OSError if the folder is not writable.
    """
    beside = claim_of(path)
    descriptor = _locked(beside)
    try:
        yield descriptor is not None
    finally:
        if descriptor is not None:
            # Removed while locked: a process that opened this file detects that it is no longer at its path.
            with contextlib.suppress(OSError):  # Windows does not remove open files
                beside.unlink()
            os.close(descriptor)
            with contextlib.suppress(OSError):
                if sys.platform == "win32":
                    beside.unlink()


def claim_of(path: str | Path) -> Path:
    """Return the file that is locked while a path is written."""
    path = Path(path)
    return path.with_name(f".{path.name}.claim")


def _locked(path):
    """Return a descriptor that holds the lock of a file, or None if another process holds it."""
    while True:
        if os.path.islink(path):  # for systems without O_NOFOLLOW
            raise OSError(errno.ELOOP, "it is a link", str(path))
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | _NEVER_ELSEWHERE, 0o666)
        try:
            if not stat.S_ISREG(os.fstat(descriptor).st_mode):
                raise OSError(errno.EINVAL, "it is not a file", str(path))
            _lock(descriptor)
        except OSError as error:
            if error.errno in _NO_LOCKS and stat.S_ISREG(os.fstat(descriptor).st_mode):
                return descriptor
            os.close(descriptor)
            if error.errno in _HELD:
                return None
            raise
        if _is_at(descriptor, path):
            return descriptor
        os.close(descriptor)  # the previous owner has removed the file meanwhile


def _lock(descriptor):
    if sys.platform == "win32":
        msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
    else:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _is_at(descriptor, path):
    try:
        return os.path.samestat(os.fstat(descriptor), os.lstat(path))
    except FileNotFoundError:
        return False
