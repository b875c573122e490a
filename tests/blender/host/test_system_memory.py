# SPDX-License-Identifier: GPL-3.0-or-later
"""Free memory of Windows and macOS is read correctly from mock system libraries."""

import ctypes
import struct
import sys

import pytest

from hair_addon.blender.host import memory, system_memory

GB = 2**30
# MEMORYSTATUSEX: two numbers of four bytes, seven of eight.
STATUS = "<IIQQQQQQQ"


class Windows:
    """A mock of kernel32 with 16 GB, of which `free` are free and `committed` may still be committed."""

    def __init__(self, free=6 * GB, committed=20 * GB, answer=1):
        self.free, self.committed, self.answer = free, committed, answer

    def GlobalMemoryStatusEx(self, pointer):
        status = pointer._obj
        assert ctypes.sizeof(status) == struct.calcsize(STATUS) == 64
        (length,) = struct.unpack("<I", bytes(status)[:4])
        assert length == 64  # or Windows refuses
        written = (length, 62, 16 * GB, self.free, 30 * GB, self.committed, 128 * GB, 127 * GB, 0)
        ctypes.memmove(ctypes.addressof(status), struct.pack(STATUS, *written), 64)
        return self.answer


class Mac:
    """A mock of the system's library, with pages of 4,096 or 16,384 bytes and versions that return few or many
    numbers.
    """

    def __init__(self, answer=0, count=38):
        self.answer, self.count = answer, count

    def mach_host_self(self):
        return 771

    def host_statistics64(self, host, flavour, pages, count):
        assert (host, flavour) == (771, 4) and count._obj.value * 4 == ctypes.sizeof(pages._obj) >= 4 * 38
        # free, active, inactive, wired; then what was counted since the start, in numbers of eight bytes.
        written = struct.pack("<IIIIQQ", 1000, 20_000, 500, 7000, 1 << 40, 1 << 41)
        ctypes.memmove(ctypes.addressof(pages._obj), written, len(written))
        count._obj.value = self.count
        return self.answer


@pytest.fixture
def system(monkeypatch, tmp_path):
    """Return a function of (name, library) that simulates another system without limits of the process."""

    def be(name, library):
        monkeypatch.setattr(sys, "platform", name)
        monkeypatch.setattr(system_memory, "_library", lambda _name: library)
        monkeypatch.setattr(memory, "_MEMINFO", tmp_path / "none")
        monkeypatch.setattr(memory, "_GROUP", tmp_path)
        monkeypatch.setattr(memory, "resource", None)
        system_memory._host.cache_clear()

    yield be
    system_memory._host.cache_clear()


def test_windows_tells_what_is_free_and_may_be_promised(system):
    system("win32", Windows())
    assert memory.free_bytes() == 6 * GB
    assert memory.share_of_free(3 * GB) == 0.5
    with pytest.raises(memory.HairError, match=r"need 5\.4 GB of memory, and 6\.4 GB are free"):
        memory.require_for_hair(5 * GB)
    system("win32", Windows(committed=2 * GB))  # of pages on disk none are left
    assert memory.free_bytes() == 2 * GB
    system("win32", Windows(free=2**40 + 5))
    assert memory.free_bytes() == 20 * GB


def test_a_mac_tells_what_is_free_and_not_used(system, monkeypatch):
    system("darwin", Mac())
    for page in (4096, 16384):
        monkeypatch.setattr(system_memory.os, "sysconf", {"SC_PAGE_SIZE": page}.__getitem__)
        assert memory.free_bytes() == 1500 * page
    system("darwin", Mac(count=40))
    assert memory.free_bytes() == 1500 * 16384


@pytest.mark.parametrize(
    ("name", "library"),
    [
        ("win32", Windows(answer=0)),
        ("win32", object()),
        ("darwin", Mac(answer=5)),
        ("darwin", Mac(count=2)),
        ("darwin", object()),
        ("freebsd14", Windows()),
    ],
    ids=["Windows refuses", "no function", "a Mac refuses", "too few numbers", "no function there", "another system"],
)
def test_what_the_system_does_not_tell_is_unknown_and_nothing_is_reported(system, name, library, capsys):
    system(name, library)
    assert memory.free_bytes() is None and memory.share_of_free(10**15) == 0.0
    with memory.asking():
        memory.require_for_hair(10**15)
    memory.require(10**15)
    memory.limit_this_process()
    reported = capsys.readouterr()
    assert reported.out + reported.err == ""


def test_no_library_is_not_known(system, monkeypatch):
    system("win32", None)

    def refuse(_name):
        raise FileNotFoundError

    monkeypatch.setattr(system_memory, "_library", refuse)
    assert memory.free_bytes() is None


@pytest.mark.skipif(sys.platform not in ("win32", "darwin"), reason="Linux has a file that tells it")
def test_this_computer_tells_a_likely_figure():
    assert 2**20 < system_memory.free_bytes() < 2**46
