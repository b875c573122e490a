# SPDX-License-Identifier: GPL-3.0-or-later
"""Curves that become guides have their root at the surface, and unusable curves are left out."""

import itertools

import numpy as np
import pytest

from hair_addon.core.errors import HairError
from hair_addon.core.geometry.mesh import TriMesh, positions
from hair_addon.core.grooming import rooted_curves

GROUND = TriMesh(np.float32([[-5, -5, 0], [5, -5, 0], [5, 5, 0], [-5, 5, 0]]), np.int32([[0, 1, 2], [0, 2, 3]]))


def grass(rng, count=40, least=2, most=12):
    """Return blades that rise from the domain: (points, starts), of any point counts."""
    lines = []
    for _ in range(count):
        rise = np.sort(rng.random(rng.integers(least, most + 1)))
        rise[0] = 0.0
        place = np.append(rng.uniform(-4.0, 4.0, 2), 0.0)
        lines.append(place + np.stack([0.3 * rise**2, 0.1 * rise, rise], axis=1))
    return rooted_curves.polylines(lines)


def lines_of(points, starts):
    return [points[first:end] for first, end in itertools.pairwise(starts)]


def test_turned_curves_are_found_and_turned_back(rng):
    points, starts = grass(rng)
    is_turned = rng.random(40) < 0.3
    pairs = zip(lines_of(points, starts), is_turned, strict=True)
    turned = np.concatenate([line[::-1] if is_back else line for line, is_back in pairs])
    rooted = rooted_curves.root(GROUND, turned, starts)
    np.testing.assert_array_equal(rooted.is_reversed, is_turned)
    np.testing.assert_array_equal(turned[rooted.point_order(starts)], points)
    np.testing.assert_allclose(positions(GROUND, rooted.roots), points[starts[:-1]], atol=1e-5)


def test_where_both_ends_are_near_the_others_decide(rng):
    """Where both ends of a curve are near the surface, as of hair that lies flat, the other curves decide its
    direction.
    """
    points, starts = grass(rng)
    flat = np.float32([[0, 0, 0.01], [0.5, 0, 0.02], [1.0, 0, 0.005]])
    for is_turned in (False, True):
        lines = [line[::-1] if is_turned else line for line in lines_of(points, starts)]
        rooted = rooted_curves.root(GROUND, *rooted_curves.polylines([*lines, flat]))
        assert rooted.is_reversed.all() if is_turned else not rooted.is_reversed.any()


def test_curves_without_a_length_or_with_bad_points_are_left_out_and_counted(rng):
    points, starts = grass(rng, 10)
    bad = [
        np.zeros((1, 3)),
        np.ones((4, 3)),
        np.float32([[0, 0, 0], [np.nan, 0, 1]]),
        np.float32([[0, 0, 0], [np.inf, 0, 1]]),
    ]
    lines = lines_of(points, starts)
    mixed = rooted_curves.polylines([*lines[:5], *bad, *lines[5:]])
    rooted = rooted_curves.root(GROUND, *mixed)
    assert rooted.skipped_count == 4
    np.testing.assert_array_equal(rooted.kept, [*range(5), *range(9, 14)])
    np.testing.assert_array_equal(mixed[0][rooted.point_order(mixed[1])], points)
    every_third = rooted_curves.root(GROUND, *mixed, every=3)
    np.testing.assert_array_equal(every_third.kept, rooted.kept[::3])


def test_far_roots_are_counted():
    lines = [np.float32([[0, 0, z], [0, 0, z + 1.0]]) for z in (0.0, 0.1, 0.3, 2.0)]
    rooted = rooted_curves.root(GROUND, *rooted_curves.polylines(lines))
    np.testing.assert_allclose(rooted.distances, [0.0, 0.1, 0.3, 2.0], atol=1e-6)
    assert rooted.far_count == 2


@pytest.mark.parametrize(
    ("curves", "reported"),
    [
        ([np.zeros((3, 3))], "length"),
        ([np.float32([[0, 0, 0], [0, 0, 1e20]])], "units"),
    ],
)
def test_what_cannot_be_used_is_one_sentence(curves, reported):
    with pytest.raises(HairError, match=reported):
        rooted_curves.root(GROUND, *rooted_curves.polylines(curves))


@pytest.mark.parametrize("curves", [[], 5, [np.zeros((3, 2))], np.zeros((4, 3)), ["ab"]])
def test_what_is_no_curves_is_one_sentence(curves):
    with pytest.raises(HairError, match="sequence of arrays"):
        rooted_curves.polylines(curves)


def test_curves_further_away_than_the_surface_is_large_are_refused(rng):
    """Curves farther away than the size of the surface are refused; a few strays are only counted."""
    points, starts = grass(rng)
    for far in (100.0 * points + 500.0, points + np.float32([0.0, 0.0, 11.0])):
        with pytest.raises(HairError, match="large: check unit and axis"):
            rooted_curves.root(GROUND, far, starts)
    assert rooted_curves.root(GROUND, points + np.float32([0.0, 0.0, 9.0]), starts).far_count == 40
    strays = points.copy()
    strays[: starts[15]] += np.float32([0.0, 0.0, 50.0])
    assert rooted_curves.root(GROUND, strays, starts).far_count == 15
