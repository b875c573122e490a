# SPDX-License-Identifier: GPL-3.0-or-later
"""Fixtures that every suite shares."""

import numpy as np
import pytest

from tests.support.devices import DEVICE


@pytest.fixture
def rng():
    """A fresh generator of known random numbers."""
    return np.random.Generator(np.random.PCG64(20260101))


@pytest.fixture
def device():
    """The Warp device that the tests compute on."""
    return DEVICE
