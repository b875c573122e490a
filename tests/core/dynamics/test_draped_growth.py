# SPDX-License-Identifier: GPL-3.0-or-later
"""Draped new guides are outside the surface, lower, as long as before, and independent of size."""

from dataclasses import replace

import numpy as np
import pytest

from hair_addon.core.dynamics import draped_growth
from hair_addon.core.geometry.mesh import TriMesh, positions
from hair_addon.core.grooming.groom import GuideSettings, distribute_guides
from tests.support.devices import DEVICE
from tests.support.meshes import subdivided_sphere

RADIUS, LENGTH = 0.1, 0.12
BALL = subdivided_sphere(4, RADIUS)
UPPER = (BALL.vertices[:, 2] > 0.0).astype(np.float32)
SETTINGS = GuideSettings(guide_count=60, length=LENGTH, length_variation=0.0, gravity=0.75, drape=True)


def grown(settings=SETTINGS, mesh=BALL, density=UPPER, **ground):
    return draped_growth.grow(mesh, settings, density=density, device=DEVICE, **ground)


def undraped(settings=SETTINGS):
    return distribute_guides(BALL, replace(settings, drape=False), density=UPPER, device=DEVICE)


def lengths(points):
    return np.linalg.norm(np.diff(points, axis=1), axis=2).sum(axis=1)


@pytest.fixture(scope="module")
def draped():
    return grown()


def test_guides_hang_lower_and_lie_closer(draped):
    free, there = undraped().numpy(), draped.numpy()
    assert there[..., 2].max() < free[..., 2].max() - 0.002
    heights, free_heights = (np.linalg.norm(points, axis=2) - RADIUS for points in (there, free))
    on_top = free[:, 0, 2] > 0.5 * RADIUS
    assert heights[on_top].mean() < 0.8 * free_heights[on_top].mean()


def test_guides_fall_away_from_the_summit(draped):
    """Guides of any tilt fall away from the summit where the surface slopes by eight degrees, and do not cross the
    whorl.
    """
    guides = draped.numpy()
    roots, falls = guides[:, 0, :2], guides[:, -1, :2] - guides[:, 0, :2]
    slopes = np.linalg.norm(roots, axis=1) / RADIUS
    cosines = np.einsum("gi,gi->g", falls, roots) / (np.linalg.norm(falls, axis=1) * np.linalg.norm(roots, axis=1))
    above = (slopes > np.sin(np.radians(8.0))) & (slopes < np.sin(np.radians(60.0)))
    assert above.sum() > 20 and cosines[above].min() > 0.7


def test_guides_stay_outside(draped):
    flat = np.linalg.norm(BALL.corners.mean(axis=1), axis=1).min()
    assert np.linalg.norm(draped.numpy(), axis=2).min() > flat - 1e-4


def test_roots_stay_to_the_bit_and_lengths(draped):
    assert np.array_equal(draped.numpy()[:, 0], undraped().numpy()[:, 0])
    np.testing.assert_allclose(lengths(draped.numpy()), LENGTH, rtol=5e-3)


def test_same_seed_same_guides(draped):
    assert np.array_equal(grown().numpy(), draped.numpy())


def test_without_draping_guides_grow_as_they_did():
    assert np.array_equal(grown(replace(SETTINGS, drape=False)).numpy(), undraped().numpy())


def test_hair_of_a_giant_hangs_alike(draped):
    """Hair falls alike at sizes that differ by powers of two, for which arithmetic is the same."""
    factor = 64.0
    giant = grown(replace(SETTINGS, length=factor * LENGTH), TriMesh(factor * BALL.vertices, BALL.triangles))
    np.testing.assert_allclose(giant.numpy() / factor, draped.numpy(), atol=1e-5 * LENGTH)


def test_without_gravity_guides_stay_as_they_grew():
    floating = replace(SETTINGS, gravity=0.0, tilt=0.0)
    np.testing.assert_allclose(grown(floating).numpy(), undraped(floating).numpy(), atol=1e-3 * LENGTH)


def test_symmetric_guides_stay_symmetric():
    settings = replace(SETTINGS, symmetric=True)
    points = grown(settings).numpy()
    images = points[: len(points) // 2] * np.float32((-1.0, 1.0, 1.0))
    np.testing.assert_allclose(points[len(points) // 2 :], images, atol=1e-3 * LENGTH)


def test_faces_out_of_reach_do_not_matter(draped):
    """Faces out of reach change neither the guides nor the number of faces on which they are draped."""
    far = TriMesh(
        np.concatenate([BALL.vertices, BALL.vertices - np.float32((0.0, 0.0, 1.0))]),
        np.concatenate([BALL.triangles, BALL.triangles + len(BALL.vertices)]),
    )
    density = np.concatenate([UPPER, 0.0 * UPPER])
    assert not draped_growth.within_reach(far, SETTINGS, density)[len(BALL.triangles) :].any()
    begun = distribute_guides(BALL, SETTINGS, density=UPPER, device=DEVICE)
    points = draped_growth.settled(begun, far, SETTINGS, density=density).numpy()
    np.testing.assert_allclose(points, draped.numpy(), atol=1e-5 * LENGTH)


def test_what_a_strand_can_touch_is_within_reach(draped):
    near = draped_growth.within_reach(BALL, SETTINGS, UPPER)
    reach = np.linalg.norm(BALL.corners.mean(axis=1)[:, None] - positions(BALL, draped.roots), axis=2).min(axis=1)
    assert near[reach < LENGTH].all()
