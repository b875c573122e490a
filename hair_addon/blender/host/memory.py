# SPDX-License-Identifier: GPL-3.0-or-later
"""Free memory, asked for before work that takes much of it."""

import contextlib
from pathlib import Path

from ...core.errors import HairError

try:
    import resource
except ModuleNotFoundError:  # Windows
    resource = None

MUCH, MOST = 0.3, 0.7  # of what is free: said before work begins, and refused

_MEMINFO = Path("/proc/meminfo")
_OWN = Path("/proc/self/statm")


def free_bytes():
    """Memory that programs can still get [bytes]; None where the system does not tell."""
    try:
        lines = _MEMINFO.read_text(encoding="ascii").splitlines()
        return next(1024 * int(line.split()[1]) for line in lines if line.startswith("MemAvailable:"))
    except (OSError, ValueError, IndexError, StopIteration):  # another system, or an older one
        return None


def share_of_free(byte_count):
    """The part of the free memory that work takes; 0 where it is not known."""
    free = free_bytes()
    return 0.0 if free is None else byte_count / max(free, 1)


def require(byte_count):
    """Raise `HairError` where work would take more memory than there is to spare."""
    if share_of_free(byte_count) > MOST:
        raise HairError(
            "This needs {needed} GB of memory, and {free} GB are free: use fewer guides or points per guide.",
            needed=f"{byte_count / 1e9:.1f}",
            free=f"{free_bytes() / 1e9:.1f}",
        )


def limit_this_process():
    """Let memory run out for this process alone, where it asks for more than there is to spare.

    Otherwise the system would end any process for it. Nothing is done where the system does not tell.
    """
    free = free_bytes()
    if free is None or resource is None:
        return
    with contextlib.suppress(OSError, ValueError):  # a lower limit holds already
        own = int(_OWN.read_text(encoding="ascii").split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (own + int(MOST * free),) * 2)
