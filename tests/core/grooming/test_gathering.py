# SPDX-License-Identifier: GPL-3.0-or-later
"""Gathered guides keep roots and lengths, pass their tie in order, and continue along its line."""

from dataclasses import replace

import numpy as np
import pytest

from hair_addon.core.errors import HairError
from hair_addon.core.geometry import surface_distance
from hair_addon.core.geometry.closest_point import SurfaceQuery
from hair_addon.core.geometry.mesh import TriMesh
from hair_addon.core.grooming.ties.gather_settings import GatherSettings
from hair_addon.core.grooming.ties.gathering import gathered
from tests.support.meshes import subdivided_sphere

RADIUS, LENGTH = 0.1, 0.3  # [m]
SETTINGS = GatherSettings(clearance=0.002, tie_radius=0.008, tail_radius=0.015, tightness=1.0)
TIE = np.array([0.0, 0.08, 0.06])  # on the sphere
IN_BRAID = 9  # the first point behind the tie of a guide of 31
TAIL = TIE + np.array([(0.0, 0.0, 0.0), (0.0, 0.03, 0.02), (0.0, 0.05, -0.02), (0.0, 0.05, -0.2)])


@pytest.fixture(scope="module")
def ball():
    return subdivided_sphere(3, RADIUS)


def guides_on(count, seed=3):
    """Return (count, 31, 3): straight guides on the upper half, in mirrored pairs across the X axis."""
    rng = np.random.default_rng(seed)
    normals = rng.normal(size=(count // 2, 3))
    normals[:, 2] = np.abs(normals[:, 2])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.concatenate([normals, normals * [-1.0, 1.0, 1.0]])
    return (normals[:, None] * (RADIUS + np.linspace(0.0, LENGTH, 31))[:, None]).astype(np.float32)


def segments(points):
    return np.linalg.norm(np.diff(points.astype(np.float64), axis=1), axis=2)


def from_tie(points, tie=TIE):
    """Return (S,) least distances of each guide's segments from the tie."""
    starts, steps = points[:, :-1].astype(np.float64), np.diff(points.astype(np.float64), axis=1)
    part = np.sum((tie - starts) * steps, axis=2) / np.sum(steps * steps, axis=2)
    return np.linalg.norm(starts + np.clip(part, 0.0, 1.0)[..., None] * steps - tie, axis=2).min(axis=1)


def test_distances_on_a_plane_are_exact_and_on_a_sphere_within_three_percent(ball):
    side = np.linspace(0.0, 1.0, 12)
    places = np.stack([*np.meshgrid(side, side), np.zeros((12, 12))], axis=-1).reshape(-1, 3).astype(np.float32)
    corner = (np.arange(11)[:, None] * 12 + np.arange(11)).ravel()
    quads = corner[:, None] + [0, 1, 13, 0, 13, 12]
    plane = TriMesh(places, quads.reshape(-1, 3).astype(np.int32))
    sources = np.full(144, np.inf)
    sources[0] = 0.0
    np.testing.assert_allclose(surface_distance.spread(plane, sources), np.linalg.norm(places, axis=1), atol=1e-6)
    found = surface_distance.source_distances(ball, SurfaceQuery(ball).nearest(np.array([[0.0, 0.0, 1.0]])))
    spread = surface_distance.spread(ball, found)
    arcs = RADIUS * np.arccos(np.clip(ball.vertices[:, 2] / RADIUS, -1.0, 1.0))
    np.testing.assert_allclose(spread, arcs, rtol=0.03, atol=0.004)


@pytest.mark.parametrize("shape", ["PONYTAIL", "BRAID", "ROPE"])
def test_roots_stay_and_guides_pass_the_tie(ball, shape):
    guides = guides_on(80)
    after, groups, _held, ties = gathered(ball, guides, [TAIL], replace(SETTINGS, shape=shape))
    of_locks = np.bincount(groups)
    assert of_locks[0] == 0
    assert len(of_locks) == {"PONYTAIL": 2, "ROPE": 3, "BRAID": 4}[shape] and np.ptp(of_locks[1:]) <= 2
    np.testing.assert_array_equal(after[:, 0], guides[:, 0])
    if shape == "PONYTAIL":
        np.testing.assert_allclose(segments(after), segments(guides), rtol=1e-4)
    lifted = TIE * (1.0 + SETTINGS.clearance / RADIUS)
    assert from_tie(after, lifted).max() < 2.0 * SETTINGS.tie_radius
    at_tie = after[np.arange(80), np.rint(30.0 * ties).astype(int)]
    assert np.linalg.norm(at_tie - lifted, axis=1).max() < 2.0 * SETTINGS.tie_radius + LENGTH / 30
    assert np.linalg.norm(after, axis=2).min() > 0.97 * RADIUS
    is_near = np.linalg.norm(guides[:, 0] - TIE, axis=1) < 0.1
    assert after[is_near, -1, 2].max() < TIE[2]  # where the line leads


@pytest.mark.parametrize("shape", ["BRAID", "ROPE"])
def test_strands_of_guides_of_any_length_stay_in_a_braid_up_to_its_tuft(ball, shape):
    """Strands are means of their guides: means of different places along a lock lie outside of the braid."""
    guides = guides_on(80)
    whole = LENGTH * np.linspace(0.9, 1.5, 80)
    guides = (guides[:, :1] + (guides - guides[:, :1]) * (whole / LENGTH)[:, None, None]).astype(np.float32)
    after, groups, _held, _ties = gathered(ball, guides, [TAIL], replace(SETTINGS, shape=shape))
    near = np.argsort(np.linalg.norm(after[:, None, 0] - after[None, :, 0], axis=2), axis=1)
    strands = []
    for guide, others in enumerate(near):
        own = others[groups[others] == groups[guide]][:3]
        strands.append(after[own].astype(np.float64).mean(axis=0))
        # In step along the braid: strands are not shortened, so they keep their place when they are lengthened.
        steps = np.diff(after[own, IN_BRAID:].astype(np.float64), axis=1)
        assert np.linalg.norm(steps.mean(axis=0), axis=1).min() > 0.9 * np.linalg.norm(steps, axis=2).min()
    assert np.linalg.norm(0.5 * (after[:, 1:] + after[:, :-1]), axis=2).min() > 0.995 * RADIUS  # also between points
    middle = after[:, IN_BRAID:].astype(np.float64).mean(axis=0)
    apart = np.linalg.norm(np.array(strands)[:, IN_BRAID:] - middle, axis=2)
    assert apart[:, :-3].max() < 1.1 * SETTINGS.tail_radius
    assert apart[:, -4].max() < 0.5 * SETTINGS.tail_radius  # the second tie
    assert apart[:, -1].max() < 0.2 * SETTINGS.tail_radius  # the tip of the tuft
    ends = after[:, -1]
    assert np.linalg.norm(ends - ends.mean(axis=0), axis=1).max() < 0.3 * SETTINGS.tail_radius


@pytest.mark.parametrize("shape", ["BRAID", "ROPE"])
@pytest.mark.parametrize("count", [2, 3, 7])
def test_guides_of_few_points_are_braided(ball, count, shape):
    some = guides_on(20)[:, np.linspace(0, 30, count).astype(int)]
    after, groups, held, _ties = gathered(ball, some, [TAIL], replace(SETTINGS, shape=shape))
    assert (groups > 0).all() and np.isfinite(after).all() and held.min() >= 0.0
    np.testing.assert_array_equal(after[:, 0], some[:, 0])


BUN = replace(SETTINGS, shape="BUN", bun_radius=0.03)
IN_BUN = 23  # points of a guide of 31


def test_hair_of_any_length_is_coiled_in_a_bun_with_its_ends_inside(ball):
    guides = guides_on(80)
    whole = LENGTH * np.linspace(0.9, 1.5, 80)
    guides = guides[:, :1] + (guides - guides[:, :1]) * (whole / LENGTH)[:, None, None]
    after, groups, _held, _ties = gathered(ball, guides.astype(np.float32), [TAIL], BUN)
    assert (groups == 1).all()
    np.testing.assert_array_equal(after[:, 0], guides[:, 0])
    assert from_tie(after, TIE * (1.0 + BUN.clearance / RADIUS)).max() < 1.1 * BUN.tie_radius
    up = TIE / RADIUS
    coiled = after[:, -IN_BUN:] - TIE
    above = coiled @ up
    beside = np.linalg.norm(coiled - above[..., None] * up, axis=2)
    assert beside.max() < 1.02 * BUN.bun_radius and above.max() < 1.2 * BUN.bun_radius
    assert np.linalg.norm(after, axis=2).min() > 0.97 * RADIUS
    turned = np.unwrap(np.arctan2(coiled[..., 0], coiled @ np.cross([1.0, 0.0, 0.0], up)), axis=1)
    assert np.abs(turned[:, -1] - turned[:, 6]).min() > 2.0 * np.pi * 0.6 * BUN.turns
    # The ends are below the coil.
    assert beside[:, -1].max() < 0.75 * BUN.bun_radius and above[:, -1].max() < 0.5 * BUN.bun_radius
    assert beside[:, -1].max() < 0.9 * beside.max(axis=1).min()


def test_means_of_guides_are_as_long_as_the_coil_of_a_bun(ball):
    """Strands are lengthened to the mean length of their guides, and stay in the bun if they are nearly as long
    already.
    """
    after, _groups, _held, _ties = gathered(ball, guides_on(80), [TAIL], BUN)
    coiled = np.diff(after[:, -IN_BUN:].astype(np.float64), axis=1)
    near = np.argsort(np.linalg.norm(after[:, None, 0] - after[None, :, 0], axis=2), axis=1)[:, :4]
    means = np.linalg.norm(coiled[near].mean(axis=1), axis=2)
    lengths = np.linalg.norm(coiled, axis=2)[near].mean(axis=1)
    assert np.quantile(means / lengths, 0.05) > 0.9


@pytest.mark.parametrize("count", [2, 3, 6])
@pytest.mark.parametrize("turns", [0.01, 100.0])
def test_buns_of_few_points_and_of_any_turns_stay_in_their_ball(ball, count, turns):
    guides = guides_on(20)[:, np.linspace(0, 30, count).astype(int)]
    after, _groups, _held, _ties = gathered(ball, guides, [TAIL], replace(BUN, turns=turns))
    assert np.linalg.norm(after[:, 2:] - TIE, axis=2).max(initial=0.0) < 1.5 * BUN.bun_radius


def test_turns_of_a_bun_have_points_enough(ball):
    """Segments between too few points would cut through the bun like the sides of a star."""
    after, _groups, _held, _ties = gathered(ball, guides_on(40), [TAIL], replace(BUN, turns=12.0))
    up = TIE / RADIUS
    coiled = after[:, -IN_BUN + 8 :].astype(np.float64) - TIE
    middles = 0.5 * (coiled[:, 1:] + coiled[:, :-1])
    beside = [np.linalg.norm(places - (places @ up)[..., None] * up, axis=2) for places in (coiled, middles)]
    ratios = beside[1] / np.minimum(beside[0][:, 1:], beside[0][:, :-1])
    assert ratios.min() > 0.75


def test_symmetric_guides_stay_symmetric(ball):
    """Symmetric guides stay symmetric, up to the asymmetry of the mesh's triangles."""
    after, _groups, _held, _ties = gathered(ball, guides_on(80), [TAIL], SETTINGS)
    mirrored = after[:40] * np.float32([-1.0, 1.0, 1.0])
    assert np.quantile(np.linalg.norm(mirrored - after[40:], axis=2), 0.95) < 0.01


@pytest.mark.parametrize("settings", [SETTINGS, BUN])
def test_a_tie_that_moves_by_a_millimeter_moves_no_point_far(ball, settings):
    guides = guides_on(80)
    after, _groups, _held, _ties = gathered(ball, guides, [TAIL], settings)
    moved, _groups, _held, _ties = gathered(ball, guides, [TAIL + np.array([0.001, 0.0, 0.0])], settings)
    assert np.linalg.norm(moved - after, axis=2).max() < 0.01


def test_guides_go_to_the_nearest_of_several_ties(ball):
    guides = guides_on(80)
    ties = [np.array([[sign * 0.1, 0.0, 0.0], [sign * 0.14, 0.0, -0.02], [sign * 0.14, 0.0, -0.2]]) for sign in (-1, 1)]
    after, groups, _held, _ties = gathered(ball, guides, ties, SETTINGS)
    is_far = np.abs(guides[:, 0, 0]) > 0.01
    assert (groups > 0).all() and (np.sign(after[is_far, -1, 0]) == np.sign(guides[is_far, 0, 0])).all()


def test_short_guides_end_on_their_way_and_other_parts_stay(ball):
    guides = guides_on(80)
    short = guides[:, :1] + 0.05 * (guides - guides[:, :1])
    after, _groups, _held, _ties = gathered(ball, short, [TAIL], BUN)
    is_far = np.linalg.norm(guides[:, 0] - TIE, axis=1) > 0.05
    np.testing.assert_allclose(segments(after)[is_far], segments(short)[is_far], rtol=1e-3)
    assert np.linalg.norm(after[is_far], axis=2).max() < RADIUS + 4.0 * SETTINGS.tie_radius
    apart = TriMesh(
        np.concatenate([ball.vertices, ball.vertices + np.float32([1.0, 0.0, 0.0])]),
        np.concatenate([ball.triangles, ball.triangles + len(ball.vertices)]),
    )
    both = np.concatenate([guides, guides + np.float32([1.0, 0.0, 0.0])])
    after, groups, _held, _ties = gathered(apart, both, [TAIL], BUN)
    assert (groups[:80] > 0).all() and not groups[80:].any()
    np.testing.assert_array_equal(after[80:], both[80:])


@pytest.mark.parametrize("scale", [0.01, 100.0])
def test_the_shape_does_not_depend_on_the_scale(ball, scale):
    guides, lengths = guides_on(60), ("tie_radius", "tail_radius", "bun_radius", "pitch", "clearance")
    settings = replace(SETTINGS, **{name: scale * getattr(SETTINGS, name) for name in lengths})
    large = TriMesh((scale * ball.vertices).astype(np.float32), ball.triangles)
    after, _groups, _held, _ties = gathered(large, np.float32(scale) * guides, [scale * TAIL], settings)
    expected, _groups, _held, _ties = gathered(ball, guides, [TAIL], SETTINGS)
    assert np.quantile(np.abs(after / scale - expected), 0.95) < 1e-3


def test_lines_without_length_are_refused(ball):
    for lines in ([], [TAIL[:1]], [np.repeat(TAIL[:1], 3, axis=0)], [np.full((2, 3), np.nan)]):
        with pytest.raises(HairError, match="curve"):
            gathered(ball, guides_on(4), lines, SETTINGS)
