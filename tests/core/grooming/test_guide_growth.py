# SPDX-License-Identifier: GPL-3.0-or-later
"""Grown guides are rooted, have the requested length and maximum tilt, and are outside the surface."""

import numpy as np
import pytest

from hair_addon.core.geometry import mesh as mesh_math
from hair_addon.core.geometry.curves import bspline
from hair_addon.core.geometry.mesh import TriMesh
from hair_addon.core.geometry.sampling import sample_surface
from hair_addon.core.geometry.strands import lengths, segment_lengths
from hair_addon.core.grooming import guide_growth
from tests.support.devices import DEVICE

STRAIGHT = {
    "length": 0.5,
    "length_variation": 0.0,
    "tilt": 0.0,
    "gravity": 0.0,
    "seed": 1,
    "control_point_count": 6,
}


def grown(mesh, roots, **settings):
    """Return points (G, 41, 3) of the curves."""
    return bspline.evaluate(guide_growth.grow(mesh, roots, **STRAIGHT | settings, device=DEVICE), 41, DEVICE).numpy()


@pytest.fixture(scope="module")
def roots(sphere):
    return sample_surface(sphere, 300, seed=1)


def test_guides_begin_at_their_roots(sphere, roots):
    points = grown(sphere, roots, gravity=0.7, tilt=0.3, length_variation=0.5)
    np.testing.assert_allclose(points[:, 0], mesh_math.positions(sphere, roots), atol=1e-6)


def test_untouched_guides_are_straight_even_and_upright(sphere, roots):
    points = grown(sphere, roots)
    directions = (points[:, -1] - points[:, 0]) / 0.5
    np.testing.assert_allclose(directions, mesh_math.normals(sphere, roots), atol=1e-4)
    np.testing.assert_allclose(segment_lengths(points), 0.5 / 40.0, rtol=1e-3)


def test_downhill_is_smooth_and_never_beyond_straight_down(rng):
    upright = rng.normal(size=(2000, 3))
    upright /= np.linalg.norm(upright, axis=1, keepdims=True)
    lift = np.radians(30.0)
    begins = guide_growth.downhill(upright, lift, 0.75)
    np.testing.assert_allclose(np.linalg.norm(begins, axis=1), 1.0, rtol=1e-12)
    # In the plane of the normal and the vertical, on the lower side of the normal.
    assert np.abs(np.einsum("gi,gi->g", np.cross(upright, begins), (0.0, 0.0, 1.0) + 0.0 * upright)).max() < 1e-12
    assert (begins[:, 2] <= upright[:, 2]).all()
    # At the angle to the surface where it slopes, or straight down where the normal is nearer to that than the angle.
    rises = np.einsum("gi,gi->g", begins, upright)
    wanted = np.maximum(np.sin(lift), -upright[:, 2])
    slopes = np.linalg.norm(upright[:, :2], axis=1) > 0.5
    np.testing.assert_allclose(rises[slopes], wanted[slopes], atol=0.01)
    # Normals that differ by little begin alike, at the summit and below an overhang too.
    poles = np.array([(0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (1.0, 0.0, 0.0)])
    near = poles + 1e-4 * rng.normal(size=(100, 1, 3))
    near /= np.linalg.norm(near, axis=2, keepdims=True)
    there = guide_growth.downhill(near.reshape(-1, 3), lift, 0.75).reshape(near.shape)
    assert np.linalg.norm(there - guide_growth.downhill(poles, lift, 0.75), axis=2).max() < 0.02
    np.testing.assert_allclose(guide_growth.downhill(upright, lift, 0.0), upright, atol=1e-12)


def test_tilt_is_the_largest_angle(sphere, roots):
    points = grown(sphere, roots, tilt=0.4)
    directions = (points[:, -1] - points[:, 0]) / 0.5
    cosines = np.einsum("gi,gi->g", directions, mesh_math.normals(sphere, roots))
    angles = np.arccos(np.clip(cosines, -1.0, 1.0))
    assert 0.37 < angles.max() < 0.401
    # Evenly over the spherical cap: as many within the angle that halves its area as beyond it.
    assert abs(np.mean(cosines > 0.5 * (1.0 + np.cos(0.4))) - 0.5) < 0.1


def test_lengths_vary_as_asked(sphere, roots):
    spread = lengths(grown(sphere, roots, length_variation=0.3))
    assert 0.35 - 1e-4 <= spread.min() < 0.36 and 0.64 < spread.max() <= 0.65 + 1e-4
    assert abs(spread.mean() - 0.5) < 0.02


@pytest.mark.parametrize("gravity", [0.25, 1.0])
def test_bending_keeps_lengths(sphere, roots, gravity):
    """Bending keeps lengths up to cut corners: 5 % for one guide in a hundred, 17 % for one that turns back."""
    bent = lengths(grown(sphere, roots, gravity=gravity, tilt=0.3))
    assert np.all(bent <= 0.5 + 1e-4)
    assert bent.mean() > 0.99 * 0.5 and np.quantile(bent, 0.02) > 0.94 * 0.5 and bent.min() > 0.8 * 0.5


def test_more_gravity_takes_tips_lower(sphere, roots):
    heights = [grown(sphere, roots, gravity=g, tilt=0.2)[:, -1, 2].mean() for g in (0.0, 0.1, 0.3, 0.6, 1.0)]
    assert np.all(np.diff(heights) < 0.0)


def test_full_gravity_lets_the_sides_hang(sphere, roots):
    """With full gravity, tips at the sides point down where nothing is in their way."""
    sides = np.abs(mesh_math.normals(sphere, roots)[:, 2]) < 0.5
    points = grown(sphere, roots, gravity=1.0, length=0.3)[sides]
    tips = points[:, -1] - points[:, -2]
    assert np.mean(tips[:, 2] < -0.9 * np.linalg.norm(tips, axis=1)) > 0.6


@pytest.mark.parametrize("length", [0.2, 1.0])
def test_guides_slide_over_the_surface(sphere, roots, length):
    points = grown(sphere, roots, gravity=1.0, tilt=0.26, length=length)
    lowest = np.linalg.norm(sphere.corners.mean(axis=1), axis=1).min()  # triangles cut into the sphere
    assert np.linalg.norm(points, axis=2).min() > lowest - 1e-3


def test_guides_lie_on_an_open_surface_and_hang_over_its_border(square):
    roots = sample_surface(square, 300, seed=2)
    points = grown(square, roots, gravity=1.0, tilt=0.5, length=0.4)
    stays = np.all((points[..., :2] > 0.0) & (points[..., :2] < 1.0), axis=(1, 2))
    assert 50 < np.count_nonzero(stays) < 250
    assert points[stays][..., 2].min() > -1e-3
    past_border = np.maximum(points[:, -1, :2] - 1.0, -points[:, -1, :2]).max(axis=1)
    hanging = points[past_border > 0.03]
    assert len(hanging) > 50
    tips = hanging[:, -1] - hanging[:, -2]
    assert np.all(tips[:, 2] < -0.5 * np.linalg.norm(tips, axis=1))


def test_without_tilt_guides_turn_with_the_surface(sphere, roots):
    """Without tilt, guides turn with the surface about the vertical, the only special direction."""
    angle = 0.7
    turn = np.array([(np.cos(angle), -np.sin(angle), 0), (np.sin(angle), np.cos(angle), 0), (0, 0, 1)])
    turned = TriMesh((sphere.vertices @ turn.T).astype(np.float32), sphere.triangles)
    clear = np.abs(mesh_math.normals(sphere, roots)[:, 2]) < 0.9  # at the top the side to fall to hangs on rounding
    expected = grown(sphere, roots, gravity=0.6)[clear] @ turn.T
    np.testing.assert_allclose(grown(turned, roots, gravity=0.6)[clear], expected, atol=2e-3)


def test_the_same_seed_grows_the_same_guides(sphere, roots):
    settings = {"tilt": 0.3, "length_variation": 0.2, "gravity": 0.5}
    first, again = (grown(sphere, roots, seed=3, **settings) for _ in range(2))
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - grown(sphere, roots, seed=4, **settings)).max() > 0.01
