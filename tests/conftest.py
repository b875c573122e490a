# SPDX-License-Identifier: GPL-3.0-or-later
"""Fixtures that every suite shares."""

import numpy as np
import pytest

from hair_addon.core.kernels import compiled_kernels
from tests.support.devices import DEVICE
from tools import build_extension, compile_kernels


def pytest_configure():
    """Load the kernels that `make build` has compiled of these sources, if it has, instead of compiling them again."""
    folder = build_extension.kernel_folder()
    if compile_kernels.are_up_to_date(folder):
        compiled_kernels.FOLDER = folder


@pytest.fixture
def rng():
    """A fresh generator of known random numbers."""
    return np.random.Generator(np.random.PCG64(20260101))


@pytest.fixture
def device():
    """The Warp device that the tests compute on."""
    return DEVICE
