# SPDX-License-Identifier: GPL-3.0-or-later
"""Chains of bones are the middle lines of clumps, with weights along them and spheres inside the surface."""

import numpy as np
import pytest

from hair_addon.core.cards import bone_chains, spring_colliders
from hair_addon.core.errors import HairError
from tests.support.meshes import subdivided_sphere


def bent(rng, count=60, points=24):
    """Return strands that hang from places on a plane, bend sideways and differ in length."""
    along = np.linspace(0.0, 1.0, points)[None, :, None] * rng.uniform(0.5, 1.0, (count, 1, 1))
    roots = np.concatenate([rng.uniform(-1.0, 1.0, (count, 1, 2)), np.zeros((count, 1, 1))], axis=2)
    return roots + along * (0.0, 0.0, -1.0) + along**2 * (0.5, 0.0, 0.0)


def test_a_chain_follows_its_strands_with_equal_bones(rng):
    """A chain of one strand has its root, tip and course; bones of a chain are equally long along the strand."""
    points = bent(rng, 5)
    joints = bone_chains.chains(points, 5, 8)
    order = bone_chains.nearest_chains(points, joints)
    assert sorted(order) == [0, 1, 2, 3, 4]
    for strand, chain in zip(points, joints[order], strict=True):
        np.testing.assert_allclose(chain[[0, -1]], strand[[0, -1]], atol=1e-6)
        np.testing.assert_allclose(
            bone_chains.arc_lengths(chain[None])[0, -1],
            np.linalg.norm(np.diff(strand, axis=0), axis=1).sum(),
            rtol=0.01,
        )
        lengths = np.linalg.norm(np.diff(chain, axis=0), axis=1)
        np.testing.assert_allclose(lengths, lengths.mean(), rtol=0.02)


def test_weights_lead_from_the_root_to_the_last_bone(rng):
    """Weights sum to one; roots follow the root bone alone, the end of a bone that bone, and points beyond it the
    last bone.
    """
    points = bent(rng)
    joints = bone_chains.chains(points, 6, 4)
    lines = np.concatenate([joints, joints[:, -1:] + (0.0, 0.0, -3.0)], axis=1)
    expected = np.concatenate([np.eye(5), np.eye(5)[-1:]])
    np.testing.assert_allclose(bone_chains.weights(lines, joints), np.broadcast_to(expected, (6, 6, 5)), atol=2e-3)
    found = bone_chains.weights(points, joints[bone_chains.nearest_chains(points, joints)])
    np.testing.assert_allclose(found.sum(axis=-1), 1.0)
    assert (found >= 0.0).all() and ((found > 0.0).sum(axis=-1) <= 2).all()


def test_strands_that_are_not_finite_make_no_chains():
    points = np.zeros((3, 4, 3))
    points[1, 2] = np.nan
    with pytest.raises(HairError, match="non-finite"):
        bone_chains.chains(points, 2, 2)


def test_spheres_are_inside_the_surface_and_touch_no_joint(rng):
    """Spheres lie inside an ellipsoid up to its facets, one nearly fills a ball, and joints keep the clearance."""
    ball = subdivided_sphere(3)
    far = rng.normal(size=(40, 3))
    far *= 1.5 / np.linalg.norm(far, axis=1)[:, None]
    centers, radii = spring_colliders.inner_spheres(ball, far, 0.01)
    assert radii[0] > 0.85 and (np.linalg.norm(centers, axis=1) + radii < 1.0 + 1e-4).all()
    near = np.concatenate([far, [[0.0, 0.0, 0.6]]])
    centers, radii = spring_colliders.inner_spheres(ball, near, 0.01)
    assert len(radii) and (np.linalg.norm(near[:, None] - centers, axis=2) >= radii + 0.01 - 1e-6).all()
