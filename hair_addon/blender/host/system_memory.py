# SPDX-License-Identifier: GPL-3.0-or-later
"""Free memory of computers whose system has no file that tells it: Windows and macOS, asked through their libraries.

What cannot be asked is not known, which nothing is said of.
"""

import ctypes
import functools
import os
import sys


class _MemoryStatus(ctypes.Structure):
    """MEMORYSTATUSEX of Windows."""

    _fields_ = (
        ("length", ctypes.c_uint32),
        ("load", ctypes.c_uint32),
        ("physical", ctypes.c_uint64),
        ("free_physical", ctypes.c_uint64),
        ("most_committed", ctypes.c_uint64),
        ("free_committed", ctypes.c_uint64),
        ("virtual", ctypes.c_uint64),
        ("free_virtual", ctypes.c_uint64),
        ("free_extended", ctypes.c_uint64),
    )


# Of macOS: what is asked for, room for more numbers than any version answers with, and which of them are pages.
_VM_INFO, _ROOM, _FREE, _INACTIVE = 4, 64, 0, 2


def free_bytes() -> int | None:
    """Memory that programs can still get [bytes]; None on other systems, and where the system does not answer."""
    ask = {"win32": _of_windows, "darwin": _of_mac}.get(sys.platform)
    try:
        return None if ask is None else ask()
    except (OSError, AttributeError):  # no such library, or no such function in it
        return None


def _of_windows():
    """No more than may be committed: Windows promises nothing that it does not have."""
    status = _MemoryStatus(length=ctypes.sizeof(_MemoryStatus))
    if not _library("kernel32").GlobalMemoryStatusEx(ctypes.byref(status)):
        return None
    return min(status.free_physical, status.free_committed)


def _of_mac():
    """Free pages, and those that were not used for long, which go when they are needed."""
    pages, count = (ctypes.c_uint32 * _ROOM)(), ctypes.c_uint32(_ROOM)
    ask = _library(None).host_statistics64
    if ask(_host(), _VM_INFO, ctypes.byref(pages), ctypes.byref(count)) or count.value <= _INACTIVE:
        return None
    return (pages[_FREE] + pages[_INACTIVE]) * os.sysconf("SC_PAGE_SIZE")


@functools.cache
def _host():
    """The right to ask a Mac, which each call would take once more."""
    return _library(None).mach_host_self()


def _library(name):
    return ctypes.CDLL(name)
