# SPDX-License-Identifier: GPL-3.0-or-later
"""Trim changes lengths, and cuts at cutters."""

import numpy as np
import pytest

from hair_addon.core.geometry.strands import segment_lengths
from hair_addon.core.styling import trim
from hair_addon.core.styling.base import Cutter
from tests.support.dynamics.stepped import curved_strands, stepped, straight_strands


def lengths(points):
    return segment_lengths(points.astype(np.float64)).sum(axis=1)


@pytest.fixture
def strands(rng):
    return curved_strands(rng)


@pytest.mark.parametrize("method", ["CUT", "SCALE"])
@pytest.mark.parametrize("factor", [0.25, 0.6, 1.0, 1.7])
def test_a_factor_multiplies_lengths(strands, method, factor):
    made = stepped(strands, trim.Settings(factor=factor, method=method))
    np.testing.assert_allclose(lengths(made), factor * lengths(strands), rtol=1e-5)


@pytest.mark.parametrize("method", ["CUT", "SCALE"])
def test_no_strand_is_longer_than_the_limit(strands, method):
    made = stepped(strands, trim.Settings(to_length=0.19, method=method))
    np.testing.assert_allclose(lengths(made), np.minimum(lengths(strands), 0.19), rtol=1e-5)


def test_two_scales_multiply(strands):
    once = stepped(strands, trim.Settings(factor=0.42, method="SCALE"))
    twice = stepped(strands, trim.Settings(factor=0.6, method="SCALE"), trim.Settings(factor=0.7, method="SCALE"))
    np.testing.assert_allclose(twice, once, atol=1e-6)


def test_a_scaled_strand_keeps_its_shape(strands):
    made = stepped(strands, trim.Settings(factor=0.5, method="SCALE"))
    np.testing.assert_allclose(made - made[:, :1], 0.5 * (strands - strands[:, :1]), atol=1e-6)


def test_a_cut_strand_lies_on_the_old_one(strands):
    """A cut strand lies on the old strand: each point is within a thousandth of the length of the polyline."""
    made = stepped(strands, trim.Settings(factor=0.55)).astype(np.float64)
    for old, new in zip(strands.astype(np.float64), made, strict=True):
        start, way = old[:-1], np.diff(old, axis=0)
        part = np.einsum("pnc,nc->pn", new[:, None] - start, way) / (way**2).sum(axis=1)
        near = start + np.clip(part, 0.0, 1.0)[:, :, None] * way
        assert np.linalg.norm(new[:, None] - near, axis=2).min(axis=1).max() < 1e-3 * 0.2


def test_a_longer_strand_goes_straight_on():
    made = stepped(straight_strands(3, 0.2), trim.Settings(factor=2.0))
    np.testing.assert_allclose(made, straight_strands(3, 0.4), atol=1e-6)


def test_random_lengths_are_even(rng):
    strands = straight_strands(4000, 0.2, 5, 0.0)
    parts = lengths(stepped(strands, trim.Settings(random=0.4))) / 0.2
    assert parts.min() >= 0.6 - 1e-5 and parts.max() <= 1.0 + 1e-5
    assert parts.mean() == pytest.approx(0.8, abs=0.01)


def test_an_undercoat_is_a_part_of_the_strands():
    strands = straight_strands(4000, 0.2, 5, 0.0)
    parts = lengths(stepped(strands, trim.Settings(undercoat=0.7, undercoat_length=0.5))) / 0.2
    assert (parts < 0.75).mean() == pytest.approx(0.7, abs=0.03)
    assert parts.min() > 0.5 - 1e-5
    assert lengths(stepped(strands, trim.Settings(undercoat=1.0))).max() == pytest.approx(0.1, rel=1e-5)


def test_a_mask_says_how_far_strands_are_trimmed():
    weights = np.linspace(0.0, 1.0, 11)
    made = stepped(straight_strands(11, 0.2), trim.Settings(factor=0.5, mask="mask"), weights=weights)
    np.testing.assert_allclose(lengths(made), 0.2 * (1.0 - 0.5 * weights), rtol=1e-5)


def test_a_cutter_leaves_nothing_on_its_far_side(strands, rng):
    normal = np.array([0.3, -0.2, 0.9])
    normal /= np.linalg.norm(normal)
    plane = Cutter(0.06 * normal, normal)
    made = stepped(strands, trim.Settings(cutter="Cutter"), cutters={"Cutter": plane})
    beyond = (made - plane.point) @ normal
    assert beyond.max() < 1e-4 * 0.2
    # Strands that crossed it end at it, all others are as they were.
    crossed = ((strands - plane.point) @ normal).max(axis=1) > 0.0
    assert crossed.any() and not crossed.all()
    assert np.abs(beyond[crossed, -1]).max() < 1e-3 * 0.2
    np.testing.assert_allclose(made[~crossed], strands[~crossed], atol=1e-6)


def test_a_cutter_below_the_root_leaves_nothing():
    plane = Cutter(np.array([0.0, 0.0, -0.1]), np.array([0.0, 0.0, 1.0]))
    made = stepped(straight_strands(3), trim.Settings(cutter="Cutter"), cutters={"Cutter": plane})
    np.testing.assert_array_equal(made, np.repeat(made[:, :1], 41, axis=1))


def test_no_length_is_all_points_at_the_root(strands):
    made = stepped(strands, trim.Settings(factor=0.0))
    np.testing.assert_array_equal(made, np.repeat(strands[:, :1], 41, axis=1))
