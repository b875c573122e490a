# SPDX-License-Identifier: GPL-3.0-or-later
"""Cornrows: guides keep their roots, go to the nearest row, and lie along it on the surface to its end."""

from dataclasses import replace

import numpy as np
import pytest

from hair_addon.core.grooming.ties.gather_settings import GatherSettings
from hair_addon.core.grooming.ties.gathering import gathered
from tests.support.meshes import subdivided_sphere

RADIUS = 0.1  # [m]
SETTINGS = GatherSettings(shape="CORNROWS", clearance=0.001, tie_radius=0.006, pitch=0.03, tightness=1.0)
FRONT, BACK = -1.2, 1.2  # angles of the ends of rows from the top


def row_at(x, count=60):
    """Return (count, 3): a row over the top of the sphere, from its front to its back."""
    angles = np.linspace(FRONT, BACK, count)
    size = np.sqrt(RADIUS**2 - x**2)
    return np.stack([np.full(count, x), size * np.sin(angles), size * np.cos(angles)], axis=1)


ROWS = [row_at(-0.03), row_at(0.03)]


@pytest.fixture(scope="module")
def ball():
    return subdivided_sphere(4, RADIUS)


@pytest.fixture(scope="module")
def guides():
    """Return (60, 25, 3): straight guides of 0.1 m on the front half, beside the rows, in mirrored pairs."""
    rng = np.random.default_rng(2)
    angles, x = rng.uniform(FRONT, 0.0, 30), rng.uniform(0.005, 0.06, 30)
    size = np.sqrt(RADIUS**2 - x**2)
    normals = np.stack([x, size * np.sin(angles), size * np.cos(angles)], axis=1) / RADIUS
    normals = np.concatenate([normals, normals * [-1.0, 1.0, 1.0]])
    return (normals[:, None] * (RADIUS + np.linspace(0.0, 0.1, 25))[:, None]).astype(np.float32)


@pytest.fixture(scope="module")
def braided(ball, guides):
    """Return (points, groups) of the guides gathered along the rows."""
    after, groups, _held, _ties = gathered(ball, guides, ROWS, SETTINGS)
    after.setflags(write=False)
    return after, groups


def from_rows(points):
    """Return (S, 2): distances of points (S, 3) from both rows."""
    return np.stack([np.linalg.norm(points[:, None] - row, axis=2).min(axis=1) for row in ROWS], axis=1)


def test_guides_lie_along_the_nearest_row(guides, braided):
    after, groups = braided
    assert (groups > 0).all()
    np.testing.assert_array_equal(after[:, 0], guides[:, 0])
    tips = from_rows(after[:, -1])
    assert (tips.argmin(axis=1) == from_rows(guides[:, 0]).argmin(axis=1)).all()
    assert tips.min(axis=1).max() < 3.0 * SETTINGS.tie_radius
    assert np.all(after[:, -1, 1] > guides[:, 0, 1] + 0.02)  # toward the end of the row
    # Guides of a row end together, and leave the skin between the rows bare.
    for side in (-1.0, 1.0):
        ends = after[np.sign(guides[:, 0, 0]) == side, -1]
        assert np.linalg.norm(ends - ends.mean(axis=0), axis=1).max() < SETTINGS.tie_radius
    assert np.array_equal(np.sign(after[..., 0]), np.sign(np.repeat(guides[:, :1, 0], 25, axis=1)))
    heights = np.linalg.norm(after[:, 1:], axis=2) - RADIUS
    assert heights.min() > -0.002 and heights.max() < 4.0 * SETTINGS.tie_radius


def test_strands_of_a_row_cross_as_a_braid_does(braided):
    """Within the last pitch, each guide lies at least a tenth of the radius on either side of the row's middle."""
    after, _groups = braided
    height = SETTINGS.clearance + 0.6 * SETTINGS.tie_radius  # of the row's middle
    beside = np.abs(after[:, -10:, 0]) - 0.03 * (1.0 + height / RADIUS)
    assert beside.max(axis=1).min() > 0.1 * SETTINGS.tie_radius
    assert beside.min(axis=1).max() < -0.1 * SETTINGS.tie_radius


def test_means_of_guides_stay_in_their_lock(braided):
    """Means of guides are nearly as long as the guides, so strands between them are hardly lengthened."""
    after, groups = braided
    steps = np.diff(after[:, 12:].astype(np.float64), axis=1)
    for group in np.unique(groups):
        own = steps[groups == group]
        assert np.linalg.norm(own.mean(axis=0), axis=1).min() > 0.9 * np.linalg.norm(own, axis=2).mean(axis=0).min()


@pytest.mark.parametrize("count", [2, 3, 4, 5, 7])
def test_guides_of_few_points_lie_along_their_row_outside_the_surface(ball, guides, count):
    """Segments are nowhere deeper than a quarter of the radius; those of two points cannot bend."""
    some = guides[::2, np.linspace(0, 24, count).astype(int)]
    after, groups, held, _ties = gathered(ball, some, ROWS, SETTINGS)
    assert (groups > 0).all() and np.isfinite(after).all() and held.min() >= 0.0
    np.testing.assert_array_equal(after[:, 0], some[:, 0])
    assert from_rows(after[:, -1]).min(axis=1).max() < 3.5 * SETTINGS.tie_radius
    share = np.linspace(0.0, 1.0, 17)[:, None]
    places = (1.0 - share) * after[:, :-1, None] + share * after[:, 1:, None]
    heights = np.linalg.norm(places, axis=3) - RADIUS
    assert count == 2 or heights.min() > -0.3 * SETTINGS.tie_radius


def test_groups_are_locks_of_rows(guides, braided):
    """Guides of a group belong to one row, and each row has three groups."""
    _after, groups = braided
    rows = from_rows(guides[:, 0]).argmin(axis=1)
    assert (groups > 0).all()
    assert ((groups - 1) // 3 == rows).all()
    assert len(np.unique(groups)) == 6


def test_guides_beyond_the_end_of_a_row_go_straight_on(ball, guides):
    longer = guides[:, :1] + 4.0 * (guides - guides[:, :1])
    after, _groups, _held, _ties = gathered(ball, longer, ROWS, SETTINGS)
    end = ROWS[1][-1]
    ahead = (ROWS[1][-1] - ROWS[1][-2]) / np.linalg.norm(ROWS[1][-1] - ROWS[1][-2])
    beyond = after[guides[:, 0, 0] > 0.0, -1] - end
    along = beyond @ ahead
    assert along.min() > 0.05
    assert np.linalg.norm(beyond - along[:, None] * ahead, axis=1).max() < 0.015


def test_tails_of_rows_narrow_to_a_second_tie_and_end_in_a_tuft(ball, guides):
    """Guides of a row come close to each other at the second tie near the end, and closer still at the tip."""
    longer = guides[:, :1] + 4.0 * (guides - guides[:, :1])
    after, groups, _held, _ties = gathered(ball, longer, ROWS, SETTINGS)
    own = after[groups <= 3].astype(np.float64)
    widths = np.linalg.norm(own - own.mean(axis=0), axis=2).max(axis=0)
    assert widths[-2] < 0.5 * SETTINGS.tie_radius and widths[-1] < 0.2 * SETTINGS.tie_radius
    assert widths[8:-4].min() > 0.5 * SETTINGS.tie_radius


def test_guides_that_are_too_short_for_a_row_do_not_shorten_its_tail(ball, guides):
    """Short guides are held up to their ends, as at other ties."""
    longer = guides[:, :1] + 4.0 * (guides - guides[:, :1])
    aside = guides[from_rows(guides[:, 0]).min(axis=1) > 2.0 * SETTINGS.tie_radius]
    stubs = aside[:, :1] + 0.01 * (aside - aside[:, :1])
    alone, _groups, _held, _ties = gathered(ball, longer, ROWS, SETTINGS)
    after, _groups, held, _ties = gathered(ball, np.concatenate([longer, *[stubs] * 4]), ROWS, SETTINGS)
    assert np.linalg.norm(after[:60, -1] - alone[:, -1], axis=1).max() < SETTINGS.tie_radius
    assert (held[60:] == 1.0).all() and (held[:60] < 1.0).all()


def test_a_row_that_moves_by_a_millimeter_moves_no_point_by_more_than_ten(ball, guides, braided):
    after, _groups = braided
    moved, _groups, _held, _ties = gathered(ball, guides, [row + np.array([0.001, 0.0, 0.0]) for row in ROWS], SETTINGS)
    apart = np.linalg.norm(moved - after, axis=2).max(axis=1)
    assert np.median(apart) < 0.004 and apart.max() < 0.010


@pytest.mark.parametrize("scale", [0.01, 100.0])
def test_the_shape_does_not_depend_on_the_scale(guides, braided, scale):
    sizes = {name: getattr(SETTINGS, name) * scale for name in ("clearance", "tie_radius", "pitch", "tail_radius")}
    expected, _groups = braided
    rows = [row * scale for row in ROWS]
    found, _groups, _held, _ties = gathered(
        subdivided_sphere(4, RADIUS * scale), guides * scale, rows, replace(SETTINGS, **sizes)
    )
    assert np.quantile(np.linalg.norm(found / scale - expected, axis=2), 0.9) < 0.002
