# SPDX-License-Identifier: GPL-3.0-or-later
"""Who makes a file: one of several processes that work on the same folder, on one machine or on several.

A claim is a lock on a file beside the one that is to be made. The system lets go of it when its process ends, however
that ends: so nothing that was killed holds up those that go on.
"""

import contextlib
import errno
import os
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None
    import msvcrt

_HELD = {errno.EACCES, errno.EAGAIN, errno.EDEADLK, errno.EWOULDBLOCK}
_NO_LOCKS = {errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP, errno.ENOTSUP, errno.EINVAL}


@contextlib.contextmanager
def claim(path):
    """Whether a file is this process's to make, for as long as this is entered: False where another is at it.

    Where a file system knows no locks everybody may: work is then done twice, and each file is still whole. Raises
    OSError where the folder cannot be written.
    """
    beside = claim_of(path)
    descriptor = _locked(beside)
    try:
        yield descriptor is not None
    finally:
        if descriptor is not None:
            # Taken away while it is held: who waits for this very file finds that it is not the one at its path.
            with contextlib.suppress(OSError):  # Windows does not take away what is open
                beside.unlink()
            os.close(descriptor)
            with contextlib.suppress(OSError):
                if fcntl is None:
                    beside.unlink()


def claim_of(path):
    """The file that is locked while a path is made."""
    path = Path(path)
    return path.with_name(f".{path.name}.claim")


def _locked(path):
    """A descriptor that holds the lock of a file, or None where another process does."""
    while True:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            _lock(descriptor)
        except OSError as error:
            if error.errno in _NO_LOCKS:
                return descriptor
            os.close(descriptor)
            if error.errno in _HELD:
                return None
            raise
        if _is_at(descriptor, path):
            return descriptor
        os.close(descriptor)  # its last holder has taken the file away meanwhile


def _lock(descriptor):
    if fcntl is not None:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    else:
        msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)


def _is_at(descriptor, path):
    try:
        return os.path.samestat(os.fstat(descriptor), os.stat(path))
    except FileNotFoundError:
        return False
