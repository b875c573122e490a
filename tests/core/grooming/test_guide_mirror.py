# SPDX-License-Identifier: GPL-3.0-or-later
"""After mirroring, a groom is its own image."""

import numpy as np
import pytest

from hair_addon.core.errors import HairError
from hair_addon.core.geometry.mesh import TriMesh, positions
from hair_addon.core.geometry.mirror import Mirror
from hair_addon.core.grooming.guide_copies import images, mirroring
from tests.support.meshes import flat_grid
from tests.support.strands.combed import lengths, standing

ACROSS_X = Mirror(np.array([1.0, 0.0, 0.0]))


def flipped(points):
    return points * np.float32([-1.0, 1.0, 1.0])


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_other_side_becomes_the_image_of_this_one(sphere, rng, sign):
    points, roots, _normals = standing(sphere, 200, rng)
    mirror = Mirror(np.array([sign, 0.0, 0.0]))
    found = mirroring(sphere, points[:, 0], mirror, np.ones(200, bool))
    side = sign * points[:, 0, 0]
    assert side[found.removed].max() < 0.0 < side[found.sources].min()
    made = images(sphere, points[found.sources], roots[found.sources], found.roots, mirror)
    np.testing.assert_allclose(made, flipped(points[found.sources]), atol=1e-5)
    # All of one side have images, and none but those near the plane are left on the other.
    kept = np.delete(np.arange(200), found.removed)
    left = kept[side[kept] < 0.0]
    middle = np.setdiff1d(kept, found.sources)
    assert set(left) <= set(middle) and np.abs(side[middle]).max(initial=0.0) < 0.02


def test_mirroring_twice_finds_the_same_groom(sphere, rng):
    points, roots, _normals = standing(sphere, 100, rng)
    found = mirroring(sphere, points[:, 0], ACROSS_X, np.ones(100, bool))
    made = images(sphere, points[found.sources], roots[found.sources], found.roots, ACROSS_X)
    both = np.concatenate([np.delete(points, found.removed, axis=0), made])
    again = mirroring(sphere, both[:, 0], ACROSS_X, np.ones(len(both), bool))
    assert len(again.removed) == len(again.sources) == len(made) > 30
    np.testing.assert_allclose(flipped(both[again.sources]), made, atol=1e-5)


def test_guides_on_the_plane_stay(square, rng):
    shifted = TriMesh(square.vertices - np.float32([0.5, 0.5, 0.0]), square.triangles)
    line = np.stack([np.zeros(9), np.linspace(-0.4, 0.4, 9), np.zeros(9)], axis=1)
    every = np.concatenate([line, line + np.array([0.1, 0.0, 0.0]), line - np.array([0.15, 0.0, 0.0])])
    found = mirroring(shifted, every, ACROSS_X, np.ones(27, bool))
    assert list(found.sources) == list(range(9, 18)) and list(found.removed) == list(range(18, 27))


def test_only_counterparts_of_chosen_guides_are_replaced(sphere, rng):
    points, _roots, _normals = standing(sphere, 300, rng)
    chosen = points[:, 0, 2] > 0.0
    found = mirroring(sphere, points[:, 0], ACROSS_X, chosen)
    assert chosen[found.sources].all()
    assert points[found.removed, 0, 2].min() > -0.2
    assert np.count_nonzero((points[:, 0, 0] < -0.05) & chosen) - len(found.removed) < 12


def test_images_on_another_shape_stand_on_it(rng):
    """Images on another shape are rooted on it and as long as their originals, where the other side is lower."""
    floor = flat_grid(20, size=2.0)
    vertices = floor.vertices - np.float32([1.0, 1.0, 0.0])
    vertices[:, 2] = np.where(vertices[:, 0] < 0.0, 0.05 * vertices[:, 0], 0.0)
    mesh = TriMesh(vertices, floor.triangles)
    points, roots, _normals = standing(mesh, 100, rng)
    found = mirroring(mesh, points[:, 0], ACROSS_X, np.ones(100, bool))
    made = images(mesh, points[found.sources], roots[found.sources], found.roots, ACROSS_X)
    np.testing.assert_allclose(made[:, 0], positions(mesh, found.roots), atol=1e-6)
    np.testing.assert_allclose(lengths(made), lengths(points[found.sources]), rtol=1e-5)
    np.testing.assert_allclose(made[:, 0, 2], 0.05 * made[:, 0, 0], atol=1e-6)


def test_nothing_to_mirror_is_reported(sphere, rng):
    points, _roots, _normals = standing(sphere, 50, rng)
    with pytest.raises(HairError, match="no guides to mirror"):
        mirroring(sphere, points[:, 0], ACROSS_X, np.zeros(50, bool))
    aside = TriMesh(sphere.vertices + np.float32([10.0, 0.0, 0.0]), sphere.triangles)
    with pytest.raises(HairError, match="no other side"):
        mirroring(aside, points[:, 0] + np.float32([10.0, 0.0, 0.0]), ACROSS_X, np.ones(50, bool))
