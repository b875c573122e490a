# SPDX-License-Identifier: GPL-3.0-or-later
"""Fixtures that every suite shares."""

import atexit
import gc
import os

import numpy as np
import pytest

from hair_addon.core.kernels import compiled_kernels
from tests.support.devices import DEVICE
from tools import build_extension, compile_kernels

# Files of few tests that take long. Processes take files one after another: begun last, these would hold up the end.
LONG_FILES = {
    *("test_install.py", "test_any_operation.py", "test_kernel_cache.py", "test_compiled_kernels.py"),
    *("test_sequence.py", "test_interruption.py", "test_api.py", "test_engine.py", "test_history.py"),
}


def pytest_configure():
    """Load the kernels that `make build` has compiled of these sources, if it has, instead of compiling them again.

    So do the processes that tests start.
    """
    folder = build_extension.kernel_folder(is_for_tests=True)
    if compile_kernels.are_up_to_date(folder):
        compiled_kernels.FOLDER = folder
        os.environ[compiled_kernels.VARIABLE] = str(folder)


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """Collect tests without looking for garbage meanwhile, of which there is little; nor later in all that it makes.

    A million objects, through which Python would look a dozen times, and pytest five times at its end. At the end they
    are released: a Blender in which tests ran would say that it was not freed.
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
    """Let every other process collect files backwards.

    Pytest rewrites the assertions of a file that has changed and writes the result for other processes: so each of two
    processes rewrites half of the files, in place of all.
    """
    if int(os.environ.get("PYTEST_XDIST_WORKER", "gw0")[2:]) % 2:
        return Backwards.from_parent(parent, path=path)
    return None


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Begin with the files that take longest; the order is the same in all processes."""
    items.sort(key=lambda item: (item.path.name not in LONG_FILES, item.path))


@pytest.fixture
def rng():
    """A fresh generator of known random numbers."""
    return np.random.Generator(np.random.PCG64(20260101))


@pytest.fixture
def device():
    """The Warp device that the tests compute on."""
    return DEVICE
