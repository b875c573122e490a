# SPDX-License-Identifier: GPL-3.0-or-later
"""Transformed strands equal those computed by NumPy, for all or some."""

import numpy as np

from hair_addon.core.geometry.transform import transformed


def test_strands_are_multiplied_by_the_matrix(rng):
    points, matrix = rng.random((9000, 7, 3), np.float32), rng.random((3, 3))
    moved = transformed(points, matrix)
    assert moved.dtype == np.float32
    np.testing.assert_allclose(moved, points @ matrix.T, atol=1e-6)
    np.testing.assert_allclose(transformed(moved, np.linalg.inv(matrix)), points, atol=1e-4)


def test_a_strand_does_not_depend_on_the_others(rng):
    """A strand does not depend on the others: strands computed alone have the same bits as among all."""
    points, matrix = rng.random((9000, 7, 3), np.float32), rng.random((3, 3))
    chosen = rng.integers(0, 9000, 50)
    np.testing.assert_array_equal(transformed(points[chosen], matrix), transformed(points, matrix)[chosen])


def test_nothing_is_copied_for_nothing(rng):
    points = rng.random((5, 7, 3), np.float32)
    assert transformed(points, np.eye(3)) is points
    assert transformed(points[:0], 2.0 * np.eye(3)).shape == (0, 7, 3)


def test_points_may_be_replaced(rng):
    points, matrix = rng.random((9000, 7, 3), np.float32), rng.random((3, 3))
    expected = transformed(points, matrix)
    assert np.shares_memory(transformed(points, matrix, out=points), points)
    np.testing.assert_array_equal(points, expected)
