# SPDX-License-Identifier: GPL-3.0-or-later
"""Free memory, asked for before work that takes much of it."""

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

MUCH, MOST = 0.3, 0.7  # of what is free: said or asked before work begins, and refused

_MEMINFO = Path("/proc/meminfo")
_OWN = Path("/proc/self/statm")
_GROUP = Path("/sys/fs/cgroup")  # of a container, or a job of a farm

_asks = False  # whether work that takes much is put off until the artist agrees


class MuchMemory(HairError):
    """Work that takes much of the free memory, and was not begun; needed, percent: as the artist reads them."""

    def __init__(self, sentence: str, **values: object) -> None:
        super().__init__(sentence, **values)
        self.needed, self.percent = values["needed"], values["percent"]


def free_bytes() -> int | None:
    """Memory that programs can still get [bytes]; None where the system does not tell."""
    found = [_available(), _left_in_group(), _left_by_limit()]
    return min((count for count in found if count is not None), default=None)


def _available():
    """Of the computer."""
    try:
        lines = _MEMINFO.read_text(encoding="ascii").splitlines()
        return next(1024 * int(line.split()[1]) for line in lines if line.startswith("MemAvailable:"))
    except (OSError, ValueError, IndexError, StopIteration):  # another system, or an older one
        return system_memory.free_bytes()


def _left_in_group():
    """Of a group of processes with a limit."""
    try:
        most, used = (int((_GROUP / f"memory.{name}").read_text(encoding="ascii")) for name in ("max", "current"))
        # What of files is kept there goes when it is needed.
        kept = (_GROUP / "memory.stat").read_text(encoding="ascii").splitlines()
        used -= next(int(line.split()[1]) for line in kept if line.startswith("inactive_file "))
    except (OSError, ValueError, IndexError, StopIteration):  # no limit, or no groups
        return None
    return max(most - used, 0)


def _left_by_limit():
    """Of this process, where its address space is limited."""
    if resource is None:
        return None
    most, _hard = resource.getrlimit(resource.RLIMIT_AS)
    if most == resource.RLIM_INFINITY:
        return None
    with contextlib.suppress(OSError, ValueError):  # a system that does not tell
        return max(most - _own_bytes(), 0)
    return None


def _own_bytes():
    """The address space of this process. Raises OSError where the system does not tell."""
    return int(_OWN.read_text(encoding="ascii").split()[0]) * resource.getpagesize()


def share_of_free(byte_count: float) -> float:
    """The part of the free memory that work takes; 0 where it is not known."""
    free = free_bytes()
    return 0.0 if free is None else byte_count / max(free, 1)


@contextlib.contextmanager
def asking(is_asked: bool = True) -> Iterator[None]:
    """Have `require_for_hair` raise `MuchMemory` in a context, where it only says so otherwise."""
    global _asks
    before, _asks = _asks, is_asked
    try:
        yield
    finally:
        _asks = before


def require(byte_count: int) -> None:
    """Raise `HairError` where work would take more memory than there is to spare."""
    if share_of_free(byte_count) > MOST:
        raise HairError(
            "This needs {needed} GB of memory, and {free} GB are free: use fewer guides or points per guide.",
            **_figures(byte_count),
        )


def require_for_hair(byte_count: int) -> None:
    """The same of guides and strands; raise `MuchMemory` where they take much of it, if that is asked for."""
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
    """Let memory run out for this process alone, where it asks for more than there is to spare.

    Otherwise the system would end any process for it. Nothing is done where the system does not tell.
    """
    free = free_bytes()
    if free is None or resource is None:
        return
    with contextlib.suppress(OSError, ValueError):  # a lower limit holds already
        resource.setrlimit(resource.RLIMIT_AS, (_own_bytes() + int(MOST * free),) * 2)
