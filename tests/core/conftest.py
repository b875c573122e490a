# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces for tests of geometry."""

import numpy as np
import pytest

import tests.support.examples  # noqa: F401 (for what it sets)
from tests.support.meshes import HEAD, flat_grid, read_obj, subdivided_sphere


@pytest.fixture(scope="session")
def head():
    """Return the sample head: 8,520 triangles in meters, facing -Y, with holes for eyes and mouth."""
    return read_obj(HEAD)


@pytest.fixture(scope="session")
def scalp(head):
    """Return a density on the head: one above the ears, zero below, and a transition of one centimeter."""
    return np.clip((head.vertices[:, 2] - 0.755) / 0.01, 0.0, 1.0)


@pytest.fixture(scope="session")
def sphere():
    """Return a closed unit sphere of 1,280 triangles."""
    return subdivided_sphere(3)


@pytest.fixture(scope="session")
def square():
    """Return an open unit square of 512 triangles."""
    return flat_grid(16)
