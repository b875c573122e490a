# SPDX-License-Identifier: GPL-3.0-or-later
"""Nearest rotations are U V^T of the singular value decomposition, also of singular matrices and mirrors."""

import numpy as np

from hair_addon.core.geometry import nearest_rotation


def by_decomposition(matrices):
    left, _stretches, right = np.linalg.svd(matrices)
    return left @ right


def test_they_are_polar_factors_of_any_scale(rng):
    matrices = rng.normal(size=(500, 3, 3)) * 10.0 ** rng.uniform(-20, 20, (500, 1, 1))
    matrices[0] = np.diag([1.0, -1.0, 1.0])
    matrices[1] = 0.0
    matrices[2:8] = [np.diag([1.0, 10.0**-n, 1.0]) for n in range(3, 9)]
    found = nearest_rotation.nearest_rotations(matrices)
    np.testing.assert_allclose(found, by_decomposition(matrices), rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(found @ np.swapaxes(found, 1, 2), np.tile(np.eye(3), (500, 1, 1)), rtol=0.0, atol=1e-12)


def test_singular_matrices_have_rotations_nearby(rng):
    """The nearest rotation to a singular matrix is ambiguous: any that is as near as the decomposition's is right."""
    matrices = rng.normal(size=(50, 3, 2)) @ rng.normal(size=(50, 2, 3))
    found = nearest_rotation.nearest_rotations(matrices)
    np.testing.assert_allclose(found @ np.swapaxes(found, 1, 2), np.tile(np.eye(3), (50, 1, 1)), rtol=0.0, atol=1e-12)
    apart, least = (np.linalg.norm(matrices - near, axis=(1, 2)) for near in (found, by_decomposition(matrices)))
    np.testing.assert_allclose(apart, least, rtol=1e-12)
