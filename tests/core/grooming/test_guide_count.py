# SPDX-License-Identifier: GPL-3.0-or-later
"""Added guides take the shape of the guides around them, and the guides left after removal are even."""

import numpy as np
import pytest

from hair_addon.core.geometry.mesh import positions
from hair_addon.core.geometry.strands import from_numpy
from hair_addon.core.grooming import guide_count
from hair_addon.core.grooming.groom import GuideSettings, HairSettings, distribute_guides
from hair_addon.core.grooming.guide_tool_settings import CountSettings
from hair_addon.core.interpolation.regions import Regions
from tests.core.placement.test_insertion import spacing


@pytest.fixture(scope="module")
def guides(sphere):
    return distribute_guides(sphere, GuideSettings(guide_count=80, length=0.4, length_variation=0.0, tilt=0.2))


def test_counts(rng):
    weights = rng.random(50)
    assert guide_count.difference(CountSettings(method="COUNT", guide_count=70), weights) == 20
    assert guide_count.difference(CountSettings(factor=3.0), np.ones(50)) == 100
    assert guide_count.difference(CountSettings(factor=0.5), np.ones(50)) == -25
    assert guide_count.difference(CountSettings(factor=2.0), weights) == round(weights.sum())


def test_new_guides_stand_on_their_roots_between_their_neighbors(sphere, guides):
    roots = guide_count.new_roots(sphere, guides.roots, 80, np.ones(80, bool))
    grown, nearest = guide_count.grown_between(sphere, guides, roots, HairSettings())
    np.testing.assert_allclose(grown[:, 0], positions(sphere, roots), atol=1e-6)
    lengths = np.linalg.norm(np.diff(grown, axis=1), axis=2).sum(axis=1)
    np.testing.assert_allclose(lengths, 0.4, rtol=0.02)
    apart = np.linalg.norm(grown[:, None, 0] - guides.numpy()[None, :, 0], axis=2)
    assert np.array_equal(nearest, apart.argmin(axis=1))


def test_new_guides_do_not_blend_across_regions(sphere, guides):
    """Between regions that lean to +Z and to -Z, no new guide has a direction in between."""
    points = guides.numpy().copy()
    side = np.where(points[:, 0, 0] > 0.0, 1.0, -1.0)
    steps = np.linspace(0.0, 0.4, points.shape[1], dtype=np.float32)
    points = (points[:, :1] + steps[None, :, None] * (side[:, None] * [0.0, 0.0, 1.0])[:, None]).astype(np.float32)
    corners = (sphere.vertices[:, 0] > 0.0).astype(np.int32)[sphere.triangles]
    regions = (Regions(corners, (side > 0.0).astype(np.int32)),)
    roots = guide_count.new_roots(sphere, guides.roots, 80, np.ones(80, bool))
    settings = HairSettings(angle_limit=np.pi)
    grown, _nearest = guide_count.grown_between(
        sphere, from_numpy(points, guides.roots), roots, settings, regions=regions
    )
    rise = grown[:, -1, 2] - grown[:, 0, 2]
    mixed, _nearest = guide_count.grown_between(sphere, from_numpy(points, guides.roots), roots, settings)
    near = np.abs(grown[:, 0, 0]) < 0.1
    assert near.sum() > 5
    apart = np.abs(rise[near])
    assert (apart > np.abs(mixed[near, -1, 2] - mixed[near, 0, 2]) - 1e-4).all() and apart.min() > 0.2


def test_fewer_guides_are_spread_evenly(sphere, rng):
    roots = guide_count.placement.cvt.place(sphere, 400, 3, 0)  # at random
    places, normals = positions(sphere, roots), positions(sphere, roots)
    removed = guide_count.most_crowded(places, normals, 300, np.ones(400, bool))
    assert len(set(removed)) == 300
    kept = np.delete(places, removed, axis=0)
    by_chance = places[rng.permutation(400)[:100]]
    evenest = positions(sphere, guide_count.placement.cvt.place(sphere, 100, 1, 12))
    assert spacing(kept).min() > 0.6 * spacing(evenest).min() > 3.0 * spacing(by_chance).min()
    assert spacing(kept).mean() > 0.8 * spacing(evenest).mean()


def test_the_first_to_go_is_one_of_the_closest_pair(sphere, rng):
    roots = guide_count.placement.cvt.place(sphere, 100, 1, 12)
    places = positions(sphere, roots).copy()
    places[17] = places[42] + 0.01
    removed = guide_count.most_crowded(places, places, 1, np.ones(100, bool))
    assert removed[0] in (17, 42)


def test_only_those_that_may_go_go(sphere):
    places = positions(sphere, guide_count.placement.cvt.place(sphere, 100, 1, 12))
    may_go = places[:, 2] > 0.0
    removed = guide_count.most_crowded(places, places, 30, may_go)
    assert len(removed) == 30 and may_go[removed].all()
    assert len(guide_count.most_crowded(places, places, 1000, may_go)) == may_go.sum()


def test_guides_on_two_sides_of_a_sheet_do_not_crowd_each_other():
    """Guides on two sides of a sheet do not crowd each other: as many are removed from each side, and none for the
    other.
    """
    x, y = np.meshgrid(np.arange(10.0), np.arange(10.0))
    front = np.stack([x.ravel(), y.ravel(), np.zeros(100)], axis=1)
    both = np.concatenate([front, front + np.array([0.0, 0.0, 0.01])])
    normals = np.repeat([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]], 100, axis=0)
    removed = guide_count.most_crowded(both, normals, 100, np.ones(200, bool))
    assert abs(np.count_nonzero(removed < 100) - 50) <= 6


def test_denser_parts_stay_denser(sphere):
    places = positions(sphere, guide_count.placement.cvt.place(sphere, 400, 1, 12))
    spread = np.where(places[:, 2] > 0.0, 4.0, 1.0)
    removed = guide_count.most_crowded(places, places, 200, np.ones(400, bool), spread)
    kept = np.delete(places, removed, axis=0)
    assert np.count_nonzero(kept[:, 2] > 0.0) > 2.0 * np.count_nonzero(kept[:, 2] < 0.0)


def test_one_guide_and_guides_in_one_place():
    one = np.zeros((1, 3))
    assert list(guide_count.most_crowded(one, one, 1, np.ones(1, bool))) == [0]
    same = np.zeros((5, 3))
    assert len(guide_count.most_crowded(same, np.tile([0.0, 0.0, 1.0], (5, 1)), 3, np.ones(5, bool))) == 3
