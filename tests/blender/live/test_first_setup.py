# SPDX-License-Identifier: GPL-3.0-or-later
"""The first-time setup runs once in the background, never without a window, and ends when the add-on is disabled."""

import threading
import time

import bpy
import pytest

from hair_addon.blender.host import paths
from hair_addon.blender.live import first_setup
from hair_addon.blender.settings import preferences
from hair_addon.core.dynamics import draped_growth
from hair_addon.core.grooming import groom
from hair_addon.core.kernels import kernel_setup


@pytest.fixture
def stamp(tmp_path, monkeypatch):
    """Act as an installed extension whose setup is not done, and return the file with the version that was set up."""
    path = tmp_path / "version"
    monkeypatch.setattr(first_setup, "_stamp", lambda: path)
    monkeypatch.setattr(preferences, "is_extension", lambda: True)
    monkeypatch.setattr(draped_growth, "load_kernels", lambda *_arguments, **_named: None)
    monkeypatch.setattr(groom, "load_later_kernels", lambda *_arguments, **_named: None)
    yield path
    first_setup.unregister()


def advance_to_the_end():
    end = time.monotonic() + 20.0
    while first_setup._advance() is not None:
        assert time.monotonic() < end
        time.sleep(0.01)


def slow(_device, progress, most_threads):
    """Act as kernels whose compilation never ends."""
    assert most_threads == 1
    while True:
        progress(kernel_setup.COMPILING, 0.5)
        time.sleep(0.01)


@pytest.mark.usefixtures("stamp")
def test_never_without_a_window():
    first_setup.register()
    assert not bpy.app.timers.is_registered(first_setup._advance)


def test_once_for_each_version(stamp, monkeypatch):
    calls = []
    monkeypatch.setattr(groom, "load_kernels", lambda *arguments, **_named: calls.append(arguments))
    advance_to_the_end()
    assert stamp.read_text() == paths.addon_version()
    advance_to_the_end()
    assert len(calls) == 1
    stamp.write_text("0.0.0")
    advance_to_the_end()
    assert len(calls) == 2


def test_a_failed_setup_is_reported_and_repeated(stamp, monkeypatch):
    def fail(*_arguments, **_named):
        raise RuntimeError("no compiler")

    monkeypatch.setattr(groom, "load_kernels", fail)
    with pytest.raises(RuntimeError, match="no compiler"):
        advance_to_the_end()
    assert not stamp.exists()


def test_disabling_while_it_compiles_leaves_no_thread(stamp, monkeypatch):
    before = {*threading.enumerate()}
    monkeypatch.setattr(groom, "load_kernels", slow)
    assert first_setup._advance() is not None
    assert not before.issuperset(threading.enumerate())
    first_setup.unregister()
    assert before.issuperset(threading.enumerate())
    assert not stamp.exists()
