# SPDX-License-Identifier: GPL-3.0-or-later
"""Free memory of Windows and macOS, from their system libraries; it is unknown, without a message, if a call fails."""

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


# macOS: the kind of statistics, the size of the buffer, more than any version fills, and the indices of page counts.
_VM_INFO, _ROOM, _FREE, _INACTIVE = 4, 64, 0, 2


def free_bytes() -> int | None:
    """Available memory [bytes]; None on other systems, or if the call fails."""
    read = {"win32": _of_windows, "darwin": _of_mac}.get(sys.platform)
    try:
        return None if read is None else read()
    except (OSError, AttributeError):  # no such library, or no such function in it
        return None


def _of_windows():
    """Free physical memory, limited to what may be committed, as Windows does not overcommit."""
    status = _MemoryStatus(length=ctypes.sizeof(_MemoryStatus))
    if not _library("kernel32").GlobalMemoryStatusEx(ctypes.byref(status)):
        return None
    return min(status.free_physical, status.free_committed)


def _of_mac():
    """Free and inactive pages, as the system reclaims inactive pages on demand."""
    pages, count = (ctypes.c_uint32 * _ROOM)(), ctypes.c_uint32(_ROOM)
    read = _library(None).host_statistics64
    if read(_host(), _VM_INFO, ctypes.byref(pages), ctypes.byref(count)) or count.value <= _INACTIVE:
        return None
    return (pages[_FREE] + pages[_INACTIVE]) * os.sysconf("SC_PAGE_SIZE")


@functools.cache
def _host():
    """Return the Mach host port; cached, as each call would create another right to it."""
    return _library(None).mach_host_self()


def _library(name):
    return ctypes.CDLL(name)
