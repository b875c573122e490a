# SPDX-License-Identifier: GPL-3.0-or-later
"""Fixtures that every suite shares."""

import gc
import os

import numpy as np
import pytest

from hair_addon.core.kernels import compiled_kernels
from tests.support.devices import DEVICE
from tools import build_extension, compile_kernels

# Files of few tests that take long. Processes take files one after another: begun last, these would hold up the end.
LONG_FILES = {"test_install.py", "test_any_operation.py", "test_kernel_cache.py", "test_compiled_kernels.py"}


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
    """Collect tests without looking for garbage meanwhile, of which there is none; nor later in all that it makes.

    A million objects, through which Python would look a dozen times, a tenth of the time of collecting.
    """
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()
        gc.collect()
        gc.freeze()


def pytest_unconfigure():
    """Let go what was frozen: a Blender in which tests ran would say at its end that it was not freed."""
    gc.unfreeze()


def pytest_collection_modifyitems(items):
    """Begin with the files that take longest."""
    items.sort(key=lambda item: item.path.name not in LONG_FILES)


@pytest.fixture
def rng():
    """A fresh generator of known random numbers."""
    return np.random.Generator(np.random.PCG64(20260101))


@pytest.fixture
def device():
    """The Warp device that the tests compute on."""
    return DEVICE
