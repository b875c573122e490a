# SPDX-License-Identifier: GPL-3.0-or-later
"""Apertures are sampled evenly, and a thin lens has its focus."""

import math

import numpy as np
import pytest

from hair_addon.core.imaging.thin_lens import Lens

LOOK = np.array([[0.8, 0.6, 0.0, 1.0], [-0.6, 0.8, 0.0, 2.0], [0.0, 0.0, 1.0, -3.0], [0.0, 0.0, 0.0, 1.0]])


def points(lens, count=1024):
    return np.array([lens.point(turn) for turn in range(count)])


def test_the_first_pass_looks_through_the_middle():
    for blades in (0, 5):
        np.testing.assert_allclose(Lens(0.01, 2.0, blades).point(0), 0.0, atol=1e-15)


def test_points_fill_a_disk_evenly():
    """The first passes have the disk's center as mean, and a quarter of the squared radius as variance per axis."""
    lens = Lens(0.02, 2.0)
    for count in (16, 64, 1024):
        spread = np.cov(points(lens, count).T, bias=True) / (0.25 * lens.radius**2)
        np.testing.assert_allclose(spread, np.eye(2), atol=2.5 / math.sqrt(count) * 0.25)
        assert np.linalg.norm(points(lens, count).mean(axis=0)) < 0.5 * lens.radius / math.sqrt(count)
    assert np.linalg.norm(points(lens), axis=1).max() <= lens.radius * (1.0 + 1e-12)


@pytest.mark.parametrize("blades", [3, 6])
def test_points_fill_a_polygon_evenly(blades):
    """Points fill a polygon evenly: none is beyond an edge, and sectors and smaller copies have numbers by their
    areas.
    """
    rotation = 0.3
    found = points(Lens(1.0, 2.0, blades, rotation))
    normals = rotation + np.arange(blades) * 2.0 * math.pi / blades
    heights = found @ np.stack([np.cos(normals), np.sin(normals)])
    apothem = math.cos(math.pi / blades)
    size = heights.max(axis=1) / apothem
    assert size.max() <= 1.0 + 1e-12
    for part in (0.25, 0.5, 0.75):
        assert (size < part).mean() == pytest.approx(part**2, abs=0.01)
    np.testing.assert_allclose(np.bincount(heights.argmax(axis=1)) / len(found), 1.0 / blades, atol=0.01)


def test_a_ratio_makes_the_aperture_narrower():
    np.testing.assert_allclose(points(Lens(1.0, 2.0, ratio=2.0)) * (2.0, 1.0), points(Lens(1.0, 2.0)))


def test_what_is_in_focus_stays_and_all_else_moves_by_the_thin_lens_formula():
    """A point at depth d moves by (1 - d / F) of the lens point, with F the focus distance."""
    lens = Lens(0.05, 2.0, 5, 0.2, 1.3)
    view = np.array([(0.3, -0.1, -depth, 1.0) for depth in (0.5, 2.0, 7.0)])
    world = view @ np.linalg.inv(LOOK).T
    for turn in range(5):
        moved = world @ lens.world_to_view(LOOK, turn).T - view
        expected = np.array([1.0 - 0.5 / 2.0, 0.0, 1.0 - 7.0 / 2.0])
        np.testing.assert_allclose(moved[:, :2], -np.outer(expected, lens.point(turn)), atol=1e-12)
        np.testing.assert_allclose(moved[:, 2:], 0.0, atol=1e-12)
