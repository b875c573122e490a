# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces that the geometry is tested on."""

import numpy as np
import pytest

import tests.support.examples  # noqa: F401 (for what it sets)
from tests.support.meshes import HEAD, flat_grid, read_obj, subdivided_sphere


@pytest.fixture(scope="session")
def head():
    """The sample head: 8,520 triangles, meters, facing -Y, with holes for eyes and mouth."""
    return read_obj(HEAD)


@pytest.fixture(scope="session")
def scalp(head):
    """Density on the head: one above the ears, thinning out over a centimeter, nothing below."""
    return np.clip((head.vertices[:, 2] - 0.755) / 0.01, 0.0, 1.0)


@pytest.fixture(scope="session")
def sphere():
    """A closed unit sphere of 1,280 triangles."""
    return subdivided_sphere(3)


@pytest.fixture(scope="session")
def square():
    """An open unit square of 512 triangles."""
    return flat_grid(16)
