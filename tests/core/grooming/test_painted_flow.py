# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides near a painted stroke turn toward its direction, and keep their roots and lengths."""

from itertools import pairwise

import numpy as np
import pytest

from hair_addon.core.grooming import painted_flow
from hair_addon.core.grooming.guide_tool_settings import FlowSettings

UP = np.array([0.0, 0.0, 1.0])
RADIUS = 0.3


@pytest.fixture
def plane(rng):
    """Return roots (G, 3) on the XY plane, their normals, and bent guides (G, P, 3)."""
    roots = np.concatenate([rng.uniform(-1.0, 1.0, (300, 2)), np.zeros((300, 1))], axis=1)
    steps = 0.05 * (rng.normal(size=(300, 1, 3)) + 0.5 * rng.normal(size=(300, 12, 3)))
    steps[..., 2] = np.abs(steps[..., 2])
    points = roots[:, None] + np.concatenate([np.zeros((300, 1, 3)), np.cumsum(steps, axis=1)], axis=1)
    points = points.astype(np.float32)
    return points[:, 0].astype(np.float64), np.broadcast_to(UP, roots.shape), points


def painted(roots, normals, corners, strength=1.0, radius=RADIUS):
    flow = painted_flow.PaintedFlow(roots, normals, radius, strength)
    for start, end in pairwise(corners):
        flow.extend(start, end, UP)
    return flow


def azimuths(points):
    lean = points[:, -1].astype(np.float64) - points[:, 0]
    return np.arctan2(lean[:, 1], lean[:, 0])


def lengths(points):
    return np.linalg.norm(np.diff(points.astype(np.float64), axis=1), axis=2)


def test_guides_turn_toward_the_stroke_inside_its_radius(plane):
    roots, normals, points = plane
    flow = painted(roots, normals, [[-0.6, 0.1, 0.0], [0.6, 0.1, 0.0]], 0.5)
    after = painted_flow.turned_along(points, normals, flow.directions, flow.shares, FlowSettings())
    distances = np.hypot(np.maximum(np.abs(roots[:, 0]) - 0.6, 0.0), roots[:, 1] - 0.1)
    is_near = distances < 0.95 * RADIUS
    assert is_near.sum() > 50
    before, turned = np.abs(azimuths(points)), np.abs(azimuths(after))
    assert (turned[is_near] < before[is_near]).all()
    is_below = (distances < 0.2 * RADIUS) & (np.abs(roots[:, 0]) < 0.4)
    assert is_below.any() and (turned < 0.5 * before)[is_below].all()
    assert np.array_equal(after[distances >= RADIUS], points[distances >= RADIUS])
    assert np.array_equal(after[:, 0], points[:, 0])
    np.testing.assert_allclose(lengths(after), lengths(points), atol=2e-7)


def test_full_strength_gives_the_direction_of_the_stroke(plane):
    roots, normals, points = plane
    flow = painted(roots, normals, [[-1.0, 0.0, 0.0], [1.0, 0.5, 0.0]])
    settings = FlowSettings(lift=0.4)
    after = painted_flow.turned_along(points, normals, flow.directions, np.ones(len(points)), settings)
    is_near = np.abs(roots[:, 1] - 0.25 - 0.25 * roots[:, 0]) < 0.2
    np.testing.assert_allclose(azimuths(after)[is_near], np.arctan2(0.5, 2.0), atol=0.02)
    lean = after[:, -1] - after[:, 0]
    rises = np.arcsin(lean[:, 2] / np.linalg.norm(lean, axis=1))
    assert rises[is_near].max() < 0.42


def test_the_speed_of_the_mouse_does_not_matter(plane):
    """A stroke of few points has the effect of the same stroke with many points."""
    roots, normals, _points = plane
    slow = [[x, 0.0, 0.0] for x in np.linspace(-0.5, 0.5, 101)]
    shares = [painted(roots, normals, corners, 0.4).shares for corners in (slow, [slow[0], slow[-1]])]
    np.testing.assert_allclose(*shares, atol=0.01)
    assert shares[0].max() > 0.5


def test_the_other_side_of_a_thin_surface_does_not_turn(plane):
    roots, normals, _points = plane
    assert not painted(roots, -normals, [[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0]]).shares.any()


def test_upright_guides_lie_down_along_the_stroke(plane):
    roots, normals, _points = plane
    upright = (roots[:, None] + np.linspace(0.0, 0.5, 9)[:, None] * UP).astype(np.float32)
    flow = painted(roots, normals, [[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0]])
    after = painted_flow.turned_along(upright, normals, flow.directions, flow.shares, FlowSettings())
    lean = (after[:, -1] - after[:, 0])[flow.shares > 0.99]
    assert len(lean) and (lean[:, 0] > 0.4).all() and np.abs(lean[:, 1]).max() < 0.02


def test_later_strokes_replace_earlier_ones(plane):
    roots, normals, _points = plane
    there_and_back = [[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0], [-0.5, 0.0, 0.0]]
    flow = painted(roots, normals, there_and_back)
    is_below = (np.abs(roots[:, 1]) < 0.05) & (np.abs(roots[:, 0]) < 0.4)
    np.testing.assert_allclose(flow.directions[is_below][:, 0], -1.0, atol=1e-6)


def test_the_work_of_a_long_stroke_with_a_small_radius_is_limited(monkeypatch):
    """A small radius, such as one typed into the redo panel, divides a stroke into millions of pieces."""
    roots = np.array([[0.0, 0.0, 0.0], [0.5, 2e-8, 0.0], [0.0, 0.5, 0.0]])
    smoothstep, calls = painted_flow._smoothstep, []

    def counted(x):
        calls.append(1)
        assert len(calls) < 200
        return smoothstep(x)

    monkeypatch.setattr(painted_flow, "_smoothstep", counted)
    flow = painted(roots, np.tile(UP, (3, 1)), [[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]], 0.5, 1e-7)
    assert flow.shares[0] > 0.5 and 0.5 < flow.shares[1] / flow.shares[0] < 1.0 and flow.shares[2] == 0.0
    np.testing.assert_allclose(flow.directions, [[1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])


def test_guides_without_a_direction_keep_their_bits(plane):
    """Guides without length, flow or share do not turn, and a guide does not depend on the others."""
    _roots, normals, points = plane
    flow, shares = np.tile([1.0, 0.2, 0.0], (300, 1)), np.full(300, 0.7)
    points[:5], flow[5:10], flow[10:15], shares[15:20] = points[:5, :1], 0.0, UP, 0.0
    after = painted_flow.turned_along(points, normals, flow, shares, FlowSettings())
    assert np.array_equal(after[:20], points[:20]) and (after[20:] != points[20:]).any(axis=(1, 2)).all()
    assert np.array_equal(after[:, 0], points[:, 0])
    chosen = np.arange(0, 300, 7)
    alone = painted_flow.turned_along(points[chosen], normals[chosen], flow[chosen], shares[chosen], FlowSettings())
    assert np.array_equal(alone, after[chosen])
    assert painted_flow.turned_along(points[:0], normals[:0], flow[:0], shares[:0], FlowSettings()).shape == (0, 13, 3)


@pytest.mark.parametrize("lean", [UP, [-1.0, 0.0, 0.0]])
def test_guides_that_stand_or_oppose_the_flow_reach_it(lean):
    """Guides along the normal and against the flow turn by a part, then completely."""
    points = (np.linspace(0.0, 1.0, 9)[:, None] * lean)[None].astype(np.float32)
    settings, flow = FlowSettings(lift=0.3), np.array([[1.0, 0.0, 0.0]])
    half, whole = (
        painted_flow.turned_along(points, UP[None], flow, np.array([share]), settings) for share in (0.5, 1.0)
    )
    rise = min(np.arcsin(np.clip(np.dot(lean, UP), -1.0, 1.0)), 0.3)
    np.testing.assert_allclose(whole[0, -1], [np.cos(rise), 0.0, np.sin(rise)], atol=1e-6)
    assert not np.array_equal(half, points) and not np.allclose(half, whole, atol=1e-3)
    np.testing.assert_allclose(lengths(half), 0.125, rtol=1e-5)
