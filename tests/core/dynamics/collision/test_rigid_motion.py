# SPDX-License-Identifier: GPL-3.0-or-later
"""A rigid motion has no residual, and the residual of other motion is bounded."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hair_addon.core.dynamics.collision.rigid_motion import RigidMotion


def test_a_rigid_motion_is_found(rng):
    points = rng.normal(size=(500, 3)).astype(np.float32)
    turn, shift = Rotation.from_rotvec([0.3, -1.0, 0.5]), np.array([2.0, -1.0, 0.5])
    (found, by), rest = RigidMotion(points, (turn.apply(points) + shift).astype(np.float32)).between(0.0, 1.0)
    np.testing.assert_allclose(found, turn.as_matrix(), atol=1e-6)
    np.testing.assert_allclose(by, shift, atol=2e-6)
    assert rest < 5e-6
    (found, by), rest = RigidMotion(points, points).between(0.2, 0.7)
    np.testing.assert_array_equal(found, np.eye(3))
    assert rest < 1e-6 and np.abs(by).max() < 1e-6


def test_many_parts_at_once_move_as_each_does(rng):
    points = rng.normal(size=(200, 3)).astype(np.float32)
    turned = Rotation.from_rotvec([0.4, 0.1, -0.6]).apply(points) * [1.1, 1.0, 0.9]
    way = RigidMotion(points, turned.astype(np.float32))
    parts = np.linspace(0.0, 1.0, 6)
    for motions in (way.between, way.carried):
        (matrices, ways), rests = motions(parts[:-1], parts[1:])
        for index, part in enumerate(pairwise(parts)):
            (matrix, shift), rest = motions(*part)
            np.testing.assert_array_equal(matrices[index], matrix)
            np.testing.assert_array_equal(ways[index], shift)
            assert rests[index] == rest


@pytest.mark.parametrize("kind", ["turn", "half turn", "mirror", "swell", "bend", "any", "point", "line"])
def test_the_rest_is_no_more_than_what_is_said(rng, kind):
    points = rng.normal(size=(300, 3)) * [1.0, 0.5, 0.2] + [3.0, 0.0, 0.0]
    if kind == "line":
        points[:, 1:] = 0.0
    turn = Rotation.from_rotvec([0.1, 0.2, -0.7])
    after = {
        "turn": turn.apply(points),
        "half turn": points * [-1, -1, 1],
        "mirror": points * [-1, 1, 1],
        "swell": 1.5 * turn.apply(points),
        "bend": turn.apply(points + 0.1 * np.sin(3.0 * points[:, [1, 2, 0]])),
        "any": rng.normal(size=points.shape),
        "point": 0.0 * points,
        "line": turn.apply(points),
    }[kind]
    before, after = points.astype(np.float32), after.astype(np.float32)
    way = RigidMotion(before, after)
    parts = [0.0, 0.1, 0.5, 0.6, 1.0]
    for first, last in pairwise(parts):
        (found, by), rest = way.between(first, last)
        np.testing.assert_allclose(found @ found.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(found) > 0.0
        start, end = (before + part * (after.astype(np.float64) - before) for part in (first, last))
        others = np.linalg.norm(end - start @ found.T - by, axis=1).max()
        assert others <= rest + 1e-5
        (carry, shift), deformation = way.carried(first, last)
        assert np.linalg.norm(end - start @ carry.T - shift, axis=1).max() <= deformation + 1e-5
        if kind in {"turn", "line"}:
            assert deformation < 1e-5
            assert rest < 0.5 * np.linalg.norm(end - start, axis=1).max()
