# SPDX-License-Identifier: GPL-3.0-or-later
"""Fixtures of all tests."""

import atexit
import gc
import os

import numpy as np
import pytest

from hair_addon.core.kernels import compiled_kernels
from tests.support.devices import DEVICE
from tools import build_extension, compile_kernels

# Files of few tests that take long. Processes take files one after another: begun last, these would hold up the end.
LONG_FILES = (
    *("test_window.py", "test_window_with_vulkan.py", "test_dynamics.py", "test_composite.py", "test_curly_hair.py"),
    *("test_first_minutes.py", "test_install.py", "test_any_operation.py", "test_kernel_cache.py"),
    *("test_compiled_kernels.py", "test_sequence.py", "test_interruption.py", "test_api.py", "test_engine.py"),
    "test_history.py",
)


def pytest_configure():
    """Load the kernels that `make build` has compiled from these sources, if there are any, also in processes of
    tests.
    """
    folder = build_extension.kernel_folder("tests")
    if compile_kernels.are_up_to_date(folder):
        compiled_kernels.FOLDER = folder
        os.environ[compiled_kernels.VARIABLE] = str(folder)


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """Collect tests without garbage collection, which would visit a million objects a dozen times.

    The objects are frozen, and released at the end, as Blender would otherwise report that it was not freed.
    """
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()
        gc.freeze()
        atexit.register(gc.unfreeze)  # before Blender's own end, as Blender is loaded by now


class Backwards(pytest.Dir):
    """A folder whose files are collected from the last to the first."""

    def collect(self):
        """Return the collectors of the folder's files, the last first."""
        return [*super().collect()][::-1]


@pytest.hookimpl
def pytest_collect_directory(path, parent):
    """Let every second process collect files in reverse order.

    Pytest rewrites the assertions of changed files and stores the result for other processes, so each of two processes
    rewrites half of the files.
    """
    if int(os.environ.get("PYTEST_XDIST_WORKER", "gw0")[2:]) % 2:
        return Backwards.from_parent(parent, path=path)
    return None


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Run the files that take longest first, in the same order in all processes."""
    rank = {name: number for number, name in enumerate(LONG_FILES)}
    items.sort(key=lambda item: (rank.get(item.path.name, len(rank)), item.path))


@pytest.fixture
def rng():
    """Return a new generator with a fixed seed."""
    return np.random.Generator(np.random.PCG64(20260101))


@pytest.fixture
def device():
    """Return the Warp device of the tests."""
    return DEVICE
