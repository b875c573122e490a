# SPDX-License-Identifier: GPL-3.0-or-later
"""Coverage is full among guides, zero far away, and independent of the mesh."""

import numpy as np
import pytest

from hair_addon.core.geometry.mesh import TriMesh
from hair_addon.core.placement.coverage import LEVELS, coverage


def grid(count):
    """Return a square of 1 m, cut into count² squares of two triangles."""
    x, y = np.meshgrid(*[np.linspace(0.0, 1.0, count + 1, dtype=np.float32)] * 2)
    vertices = np.stack([x.ravel(), y.ravel(), 0.0 * x.ravel()], axis=1)
    corner = (np.arange(count)[:, None] * (count + 1) + np.arange(count)).ravel()
    lower = np.stack([corner, corner + 1, corner + count + 2], axis=1)
    upper = np.stack([corner, corner + count + 2, corner + count + 1], axis=1)
    return TriMesh(vertices, np.concatenate([lower, upper]).astype(np.int32))


def rooted_in(rng, low, high, count=400):
    """Return (count, 3) random roots with x between two numbers."""
    return np.float32(np.c_[rng.uniform(low, high, count), rng.random(count), np.zeros(count)])


@pytest.mark.parametrize("cuts", [4, 20, 100])
def test_it_is_full_among_roots_and_zero_away_from_them(rng, cuts):
    mesh = grid(cuts)
    weights = coverage(mesh, rooted_in(rng, 0.0, 0.4))
    x = mesh.vertices[:, 0]
    assert (weights[x < 0.4] == 1.0).mean() > 0.95
    reach = 1.3 * max(0.12, 1.5 / cuts)
    assert (weights[x > 0.4 + reach] == 0.0).all() and (weights == 0.0).any()
    np.testing.assert_array_equal(np.unique(weights * LEVELS) % 1.0, 0.0)


def test_every_triangle_that_holds_a_root_is_full(rng):
    """Every triangle with a root is fully covered, however large it is compared with the distances between roots."""
    mesh = grid(4)
    roots = rooted_in(rng, 0.0, 0.2)
    weights = coverage(mesh, roots)
    holding = np.unique((roots[:, :2] * 4).astype(int), axis=0)
    for column, row in holding:
        corners = [row * 5 + column + step for step in (0, 1, 5, 6)]
        assert (weights[corners] == 1.0).all()


def test_it_does_not_depend_on_scale(rng):
    mesh, roots = grid(20), rooted_in(rng, 0.3, 0.7)
    small = TriMesh(mesh.vertices * np.float32(2.0**-10), mesh.triangles)
    np.testing.assert_array_equal(coverage(small, roots * np.float32(2.0**-10)), coverage(mesh, roots))


def test_all_over_or_too_few_is_none(rng):
    assert coverage(grid(10), rooted_in(rng, 0.0, 1.0)) is None
    assert coverage(grid(10), rooted_in(rng, 0.0, 0.1, 4)) is None
