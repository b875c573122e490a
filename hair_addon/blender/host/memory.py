# SPDX-License-Identifier: GPL-3.0-or-later
"""Free memory, checked before work that needs much of it."""

import contextlib
from collections.abc import Iterator
from pathlib import Path

from ...core.errors import HairError
from . import system_memory
from .notices import say

try:
    import resource
except ModuleNotFoundError:  # Windows
    resource = None

MUCH, MOST = 0.3, 0.7  # fractions of the free memory: reported or confirmed before work begins, and refused

_MEMINFO = Path("/proc/meminfo")
_OWN = Path("/proc/self/statm")
_GROUP = Path("/sys/fs/cgroup")  # of a container or a render farm's job

_asks = False  # whether work that needs much memory waits until the artist confirms


class MuchMemory(HairError):
    """Work needs much of the free memory, and was not begun; needed, percent: as displayed."""

    def __init__(self, sentence: str, **values: object) -> None:
        super().__init__(sentence, **values)
        self.needed, self.percent = values["needed"], values["percent"]


def free_bytes() -> int | None:
    """Memory available to this process [bytes]; None if it is unknown."""
    found = [_available(), _left_in_group(), _left_by_limit()]
    return min((count for count in found if count is not None), default=None)


def _available():
    """Available memory of the computer [bytes]."""
    try:
        lines = _MEMINFO.read_text(encoding="ascii").splitlines()
        return next(1024 * int(line.split()[1]) for line in lines if line.startswith("MemAvailable:"))
    except (OSError, ValueError, IndexError, StopIteration):  # another system, or an older one
        return system_memory.free_bytes()


def _left_in_group():
    """Available memory of a control group with a limit [bytes]."""
    try:
        most, used = (int((_GROUP / f"memory.{name}").read_text(encoding="ascii")) for name in ("max", "current"))
        # The system drops cached pages of files on demand.
        statistics = (_GROUP / "memory.stat").read_text(encoding="ascii").splitlines()
        used -= next(int(line.split()[1]) for line in statistics if line.startswith("inactive_file "))
    except (OSError, ValueError, IndexError, StopIteration):  # no limit, or no groups
        return None
    return max(most - used, 0)


def _left_by_limit():
    """Free address space of this process [bytes]; None without a limit."""
    if resource is None:
        return None
    most, _hard = resource.getrlimit(resource.RLIMIT_AS)
    if most == resource.RLIM_INFINITY:
        return None
    with contextlib.suppress(OSError, ValueError):  # unknown on this system
        return max(most - _own_bytes(), 0)
    return None


def _own_bytes():
    """Address space used by this process [bytes]. Raises OSError where it is unknown."""
    return int(_OWN.read_text(encoding="ascii").split()[0]) * resource.getpagesize()


def share_of_free(byte_count: float) -> float:
    """Return the fraction of the free memory that `byte_count` bytes take; 0 if free memory is unknown."""
    free = free_bytes()
    return 0.0 if free is None else byte_count / max(free, 1)


@contextlib.contextmanager
def asking(is_asked: bool = True) -> Iterator[None]:
    """Let `require_for_hair` raise `MuchMemory` in a context; otherwise it only prints a message."""
    global _asks
    before, _asks = _asks, is_asked
    try:
        yield
    finally:
        _asks = before


def require(byte_count: int) -> None:
    """Raise `HairError` if work needs more memory than can be spared."""
    if share_of_free(byte_count) > MOST:
        raise HairError(
            "This needs {needed} GB of memory, and {free} GB are free: use fewer guides or points per guide.",
            **_figures(byte_count),
        )


def require_for_hair(byte_count: int) -> None:
    """Raise as `require` for strands, and `MuchMemory` within `asking` if they take much of the free memory."""
    if byte_count <= 0:
        return
    share = share_of_free(byte_count)
    if share > MOST:
        raise HairError(
            "These strands need {needed} GB of memory, and {free} GB are free: use fewer strands or points.",
            **_figures(byte_count),
        )
    if share > MUCH:
        much = MuchMemory(
            "These strands take {needed} GB, {percent}% of the free memory: use fewer, or click Regenerate Strands.",
            needed=f"{byte_count / 1e9:.1f}",
            percent=round(100.0 * share),
        )
        if _asks:
            raise much
        say(f"These strands take {much.needed} GB, {much.percent}% of the free memory.")


def _figures(byte_count):
    return {"needed": f"{byte_count / 1e9:.1f}", "free": f"{(free_bytes() or 0) / 1e9:.1f}"}


def limit_this_process() -> None:
    """Limit the address space of this process to the memory that can be spared, so that its allocations fail.

    Without a limit the system may end other processes. No effect where free memory is unknown.
    """
    free = free_bytes()
    if free is None or resource is None:
        return
    with contextlib.suppress(OSError, ValueError):  # a lower limit is set already
        resource.setrlimit(resource.RLIMIT_AS, (_own_bytes() + int(MOST * free),) * 2)
