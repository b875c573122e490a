# SPDX-License-Identifier: GPL-3.0-or-later
"""Smoothing, lifting and attraction rotate segments: roots do not move, and lengths are kept."""

import numpy as np
import pytest

from hair_addon.core.geometry.closest_point import SurfaceQuery
from hair_addon.core.geometry.mesh import positions
from hair_addon.core.grooming import guide_shapes
from hair_addon.core.grooming.guide_attraction import attracted
from hair_addon.core.grooming.guide_shapes import lifted, smoothed
from hair_addon.core.grooming.guide_tool_settings import AttractSettings, LiftSettings, SmoothSettings
from tests.support.meshes import flat_grid, subdivided_sphere
from tests.support.strands.combed import lengths, segment_lengths, standing, wavy


def smooth(_mesh, points, _normals, weights):
    return smoothed(points, SmoothSettings(strength=0.8, iterations=20), weights)


def lift(_mesh, points, normals, weights):
    return lifted(points, normals, LiftSettings(amount=0.7, reach=0.6), weights)


def attract(mesh, points, normals, weights):
    return attracted(mesh, points, normals, AttractSettings(amount=0.8, clearance=0.01), weights)


TOOLS = (smooth, lift, attract)


@pytest.fixture
def ball():
    return subdivided_sphere(3)


def angles(directions, targets):
    """Return angles [rad] between unit vectors."""
    return np.arccos(np.clip(np.sum(directions * targets, axis=-1), -1.0, 1.0))


def heights(mesh, places):
    """Return heights of places (N, 3) above a mesh: signed distances to its nearest points, negative inside the
    sphere.
    """
    flat = places.reshape(-1, 3)
    return np.linalg.norm(flat - positions(mesh, SurfaceQuery(mesh).nearest(flat)), axis=1).reshape(places.shape[:-1])


@pytest.mark.parametrize("tool", TOOLS)
def test_roots_and_segment_lengths_are_kept(ball, rng, tool):
    points, _roots, normals = standing(ball, 60, rng)
    changed = tool(ball, points, normals, np.ones(60))
    assert changed.dtype == np.float32 and changed.shape == points.shape
    assert np.array_equal(changed[:, 0], points[:, 0])
    np.testing.assert_allclose(segment_lengths(changed), segment_lengths(points), rtol=2e-5)
    np.testing.assert_allclose(lengths(changed), lengths(points), rtol=2e-6)
    assert np.abs(changed - points).max() > 1e-3


@pytest.mark.parametrize("tool", TOOLS)
def test_guides_without_weight_stay_to_the_last_bit(ball, rng, tool):
    points, _roots, normals = standing(ball, 60, rng)
    weights = (np.arange(60) % 3 == 0).astype(float)
    changed = tool(ball, points, normals, weights)
    assert np.array_equal(changed[weights == 0.0], points[weights == 0.0])
    every = tool(ball, points, normals, np.ones(60))
    np.testing.assert_allclose(changed[weights == 1.0], every[weights == 1.0], atol=1e-6)


@pytest.mark.parametrize("tool", TOOLS)
def test_degenerate_guides_are_finite(ball, rng, tool):
    points, _roots, normals = standing(ball, 12, rng)
    points[0] = points[0, 0]  # no length
    points[1, 5] = points[1, 6]  # a doubled point
    points[2, 8:] = points[2, 7:6:-1]  # turns back
    points[3] = points[3, :1] + np.linspace(0.0, -0.2, 21)[:, None] * normals[3]  # into the surface
    points[4] = points[4, :1] + np.linspace(0.0, 0.2, 21)[:, None] * normals[4]  # upright
    changed = tool(ball, points.astype(np.float32), normals, np.ones(12))
    assert np.isfinite(changed).all()
    assert np.array_equal(changed[:, 0], points[:, 0])
    for count in (1, 2):
        short = np.ascontiguousarray(points[:, :count], np.float32)
        assert tool(ball, short, normals, np.ones(12)).shape == short.shape


def test_straight_guides_stay_straight(rng):
    points = wavy(rng, point_count=2)
    points = (points[:, :1] + np.linspace(0.0, 1.0, 20)[None, :, None] * (points[:, 1:] - points[:, :1])).astype(
        np.float32
    )
    np.testing.assert_allclose(smooth(None, points, None, np.ones(30)), points, atol=1e-6)


def bending(points):
    directions, _lengths = guide_shapes.split(points)
    return angles(directions[:, 1:], directions[:, :-1]).sum(axis=1)


def test_smoothing_bends_less_the_more_of_it_there_is(rng):
    points, before = wavy(rng), np.inf
    for iterations in (1, 5, 20, 100):
        after = bending(smoothed(points, SmoothSettings(iterations=iterations), np.ones(30)))
        assert (after < before).all() and (after < bending(points)).all()
        before = after


def test_lifting_turns_most_at_the_root(ball, rng):
    points, _roots, normals = standing(ball, 60, rng, spread=2.0)
    changed = lifted(points, normals, LiftSettings(amount=0.6), np.ones(60))
    (was, _), (now, _) = guide_shapes.split(points), guide_shapes.split(changed)
    turns = angles(was, now) / np.maximum(angles(was, normals[:, None]), 1e-6)
    assert (turns[:, 1:-1] >= turns[:, 2:] - 1e-6).all()
    np.testing.assert_allclose(turns[:, 1], 0.6, atol=0.05)
    assert turns[:, -1].max() < 0.01


def test_a_full_lift_starts_along_the_normal_and_its_reach_ends(ball, rng):
    points, _roots, normals = standing(ball, 60, rng, spread=2.0)
    changed = lifted(points, normals, LiftSettings(amount=1.0, reach=0.5), np.ones(60))
    (was, _), (now, _) = guide_shapes.split(points), guide_shapes.split(changed)
    assert angles(now[:, 0], normals).max() < 0.02
    np.testing.assert_allclose(now[:, 14:], was[:, 14:], atol=1e-5)


def test_guides_laid_on_a_plane_lie_at_the_clearance(rng):
    floor = flat_grid(8, size=4.0)
    points, _roots, normals = standing(floor, 60, rng, spread=0.5)
    inside = np.abs(points[:, 0, :2] - 2.0).max(axis=1) < 1.4
    changed = attracted(floor, points, normals, AttractSettings(amount=1.0, clearance=0.01), np.ones(60))[inside]
    assert len(changed) > 10
    np.testing.assert_allclose(changed[:, 4:, 2], 0.01, atol=2e-5)
    # They lie the way that they leaned.
    lean, lies = (array[:, -1, :2] - array[:, 0, :2] for array in (points[inside], changed))
    cosine = np.sum(lean * lies, axis=1) / np.linalg.norm(lean, axis=1) / np.linalg.norm(lies, axis=1)
    assert cosine.min() > 0.999


@pytest.mark.parametrize("amount", [0.2, 0.5, 1.0])
def test_attracted_guides_come_closer_and_keep_clear(ball, rng, amount):
    points, _roots, normals = standing(ball, 60, rng)
    changed = attracted(ball, points, normals, AttractSettings(amount=amount, clearance=0.02), np.ones(60))
    assert (heights(ball, changed)[:, -1] < heights(ball, points)[:, -1]).all()
    out = np.linalg.norm(changed, axis=2)
    assert (heights(ball, changed)[:, 4:] > 0.02 - 2e-3).all() and (out[:, 1:] > 0.995).all()
    if amount == 1.0:
        np.testing.assert_allclose(heights(ball, changed)[:, 4:], 0.02, atol=2e-3)


def test_a_guide_that_pierces_the_surface_is_raised(ball, rng):
    points, _roots, normals = standing(ball, 60, rng)
    sunk = points[:, :1] + 0.3 * np.linspace(0, 1, 21)[:, None] * (np.roll(normals, 1, axis=1) - 0.5 * normals)[:, None]
    changed = attracted(
        ball, sunk.astype(np.float32), normals, AttractSettings(amount=0.1, clearance=0.01), np.ones(60)
    )
    was, now = (np.linalg.norm(array, axis=2)[:, 4:] for array in (sunk, changed))
    assert was.min() < 0.9 and now.min() > 0.99


def test_upright_guides_lie_down_somewhere(ball):
    up = np.eye(3, dtype=np.float32)
    points = up[:, None] * np.linspace(1.0, 1.4, 21, dtype=np.float32)[:, None]
    changed = attracted(ball, points, up, AttractSettings(amount=1.0, clearance=0.01), np.ones(3))
    np.testing.assert_allclose(heights(ball, changed)[:, 5:], 0.01, atol=2e-3)
    assert (changed[0, -1, 2], changed[1, -1, 2]) < (-0.3, -0.3)  # the way that things fall


def test_rotations_are_the_least(rng):
    start, end = (guide_shapes.unit(rng.normal(size=(50, 3))) for _ in range(2))
    end[0], end[1] = start[0], -start[1]
    found = guide_shapes.rotations(start, end)
    np.testing.assert_allclose(np.einsum("nij,nj->ni", found, start), end, atol=1e-9)
    np.testing.assert_allclose(found @ np.swapaxes(found, 1, 2), np.tile(np.eye(3), (50, 1, 1)), atol=1e-9)
    turn = np.arccos(np.clip((np.trace(found, axis1=1, axis2=2) - 1.0) / 2.0, -1.0, 1.0))
    np.testing.assert_allclose(turn, angles(start, end), atol=1e-6)


def test_blending_ends_at_both_shapes(rng):
    one, other = wavy(rng), wavy(rng)
    other += one[:, :1] - other[:, :1]
    np.testing.assert_allclose(guide_shapes.blended(one, other, np.zeros(30)), one, atol=1e-6)
    np.testing.assert_allclose(guide_shapes.blended(one, other, np.ones(30)), other, atol=1e-6)
    half = guide_shapes.blended(one, other, np.full(30, 0.5))
    np.testing.assert_allclose(segment_lengths(half), 0.5 * (segment_lengths(one) + segment_lengths(other)), rtol=1e-4)


@pytest.mark.parametrize("tool", [smooth, lift])
def test_turned_moved_and_scaled_guides_are_changed_alike(ball, rng, tool):
    """Turned, moved and scaled guides are changed alike, except by attraction: upright guides fall to a side that a
    turn changes.
    """
    points, _roots, normals = standing(ball, 40, rng)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    there = (3.0 * points @ turn.T + np.array([1.0, -2.0, 0.5])).astype(np.float32)
    before = 3.0 * tool(None, points, normals, np.ones(40)) @ turn.T + np.array([1.0, -2.0, 0.5])
    np.testing.assert_allclose(tool(None, there, normals @ turn.T, np.ones(40)), before, atol=2e-5)
