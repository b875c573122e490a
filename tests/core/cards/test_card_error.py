# SPDX-License-Identifier: GPL-3.0-or-later
"""The error of cards is 0 for the strands themselves, falls with the number of cards, and decides placements."""

from dataclasses import replace

import numpy as np
import pytest

from hair_addon.core.cards import best_placement, card_views
from hair_addon.core.cards.card_error import CardShares, Comparison, card_error
from hair_addon.core.cards.card_exchange import exchanged
from hair_addon.core.cards.card_layout import CardStrands, Clumps, Placement, clumps_of
from hair_addon.core.cards.card_settings import CardSettings, Level
from hair_addon.core.geometry.mesh import TriMesh
from hair_addon.core.long_work import no_progress
from tests.core.cards.conftest import sphere, wavy_hair
from tests.support.pairs import share_of_rows

SAMPLES = 128  # fewer than the default take less time
LEVEL = Level(40, 6, 256)


@pytest.fixture(scope="module")
def strands():
    rng = np.random.default_rng(3)
    points = wavy_hair(rng, 400, 13)
    colors = np.float32([0.3, 0.15, 0.07]) * rng.uniform(0.6, 1.4, (400, 1, 1)).repeat(13, axis=1).astype(np.float32)
    return CardStrands(points, np.full(points.shape[:2], 1e-3, np.float32), colors, sphere())


@pytest.fixture(scope="module")
def comparison(strands):
    return Comparison(strands, samples=SAMPLES)


def views(strands):
    sides = card_views.Sides(strands.points, strands.surface, SAMPLES)
    return list(sides.of_strands(strands.points, strands.radii, strands.colors))


def error(comparison, strands, count, texture_size=256, **changes):
    level, settings = Level(count, 6, texture_size), CardSettings(card_count=count, **changes)
    return best_placement.placement_error(comparison, strands, level, settings, Placement())


def test_strands_beside_themselves_have_no_error(strands):
    seen = views(strands)
    found = card_error(seen, seen)
    assert (found.coverage, found.flip, found.mean) == (0.0, 0.0, 0.0)


def test_views_are_six_different_sides_with_hair_around_the_surface(strands):
    """Opposite sides are covered alike, except where the surface hides hair: from below, the sphere shows through."""
    seen = views(strands)
    coverage = [view.pixels(32)[1] for view in seen]
    assert len(seen) == 6 and min(part.mean() for part in coverage) > 0.05
    front, back, above, below = (coverage[side] for side in (0, 1, 4, 5))
    assert np.abs(front - back[:, ::-1]).mean() < 0.25 * front.mean()
    assert below[14:18, 14:18].max() == 0.0 < above[14:18, 14:18].mean()


def test_thinner_strands_cover_less_and_differ(strands):
    """Strands of half the thickness have an error, and a smaller coverage from each side."""
    thin = replace(strands, radii=0.5 * strands.radii)
    pairs = zip(views(strands), views(thin), strict=True)
    assert all(one.coverage.sum() > 1.2 * other.coverage.sum() for one, other in pairs)
    found = card_error(views(strands), views(thin))
    assert 0.1 < found.coverage < 1.0 and 0.02 < found.flip < 1.0


def test_more_cards_have_less_error(comparison, strands):
    errors = [error(comparison, strands, count, 512).mean for count in (4, 40, 160)]
    assert errors[0] > errors[1] > errors[2] > 0.0


@pytest.mark.parametrize(("scale", "place"), share_of_rows([(0.01, 0.0), (100.0, 0.0), (1.0, 30.0)], 2))
def test_the_error_does_not_depend_on_unit_and_place(comparison, strands, scale, place):
    """Cards of scaled or moved strands have the error of the original cards, within rounding."""
    surface = TriMesh(np.float32(scale * strands.surface.vertices + place), strands.surface.triangles)
    points = np.float32(scale * strands.points + place)
    moved = replace(strands, points=points, radii=np.float32(scale * strands.radii), surface=surface)
    found, wanted = error(Comparison(moved, samples=SAMPLES), moved, 40), error(comparison, strands, 40)
    assert found.coverage == pytest.approx(wanted.coverage, rel=0.03)
    assert found.flip == pytest.approx(wanted.flip, rel=0.03)


def test_crossed_cards_have_less_error_than_as_many_single_cards(comparison, strands):
    assert error(comparison, strands, 40, crossed=1.0).coverage < 0.8 * error(comparison, strands, 40).coverage


@pytest.mark.long
def test_the_chosen_placement_has_the_least_error_of_its_trials(comparison, strands, monkeypatch):
    """The best placement has at most the error of every trial, for the same number of cards."""
    monkeypatch.setattr(best_placement, "_TIP", ())
    monkeypatch.setattr(best_placement, "_OUTWARD", (0.5,))
    tried = []

    def measured(*given):
        tried.append((given[3:], measure(*given)))
        return tried[-1][1]

    measure = best_placement.placement_error
    monkeypatch.setattr(best_placement, "placement_error", measured)
    settings = CardSettings(card_count=40)
    best = best_placement.best_placement(comparison, strands, LEVEL, settings, no_progress)
    least = min(tried, key=lambda trial: trial[1].mean)
    found = measure(comparison, strands, LEVEL, *best).mean
    assert best[0] == least[0][0] and found <= least[1].mean < 0.9 * tried[0][1].mean
    assert best[1].clumps.count + len(best[1].clumps.crossed) == 40
    assert tried[0][0] == (settings, Placement()) and len(tried) == 4
    tried.clear()
    given = CardSettings(card_count=40, crossed=0.25)
    best = best_placement.best_placement(comparison, strands, LEVEL, given, no_progress)
    assert best[0] == given and len(tried) == 2  # the settings determine the crossed cards


def test_shares_of_cards_add_up_to_the_samples_that_are_seen(comparison, strands):
    """Every sample with hair counts for one card, and the total error does not depend on the shares."""
    clumps = clumps_of(strands, LEVEL, CardSettings(crossed=0.3), Placement())
    mesh, maps = best_placement._drawn(strands, LEVEL, CardSettings(), Placement(clumps=clumps))
    error, shares = comparison.shares_of(mesh, maps, LEVEL.segment_count, clumps.labels)
    assert error == comparison.error_of(mesh, maps)
    sides = card_views.Sides(strands.points, strands.surface, SAMPLES)
    assert shares.seen.sum() == sum(np.count_nonzero(view.seen >= 0) for view in sides.of_cards(mesh, maps))
    assert len(shares.seen) == LEVEL.card_count and (shares.errors >= 0.0).all() and shares.errors.sum() > 0.0


def test_exchanges_give_cards_of_hidden_clumps_to_those_with_errors():
    """A hidden clump joins the most similar one that stays, and the clump with the largest error is divided."""
    features = (
        np.repeat(np.arange(5.0, dtype=np.float32), 4)[:, None] + np.tile(np.float32([0.0, 0.0, 0.2, 0.2]), 5)[:, None]
    )
    clumps = Clumps(np.arange(5, dtype=np.int32).repeat(4), np.array([0]))
    shares = CardShares(np.array([5.0, 1.0, 1.0, 1.0, 1.0, 5.0]), np.array([9.0, 9.0, 9.0, 0.0, 8.0, 9.0]))
    found = exchanged(features, clumps, shares, 1)
    joined = found.labels.reshape(5, 4)
    assert len(set(joined[3]) | set(joined[4])) == 1 or len(set(joined[3]) | set(joined[2])) == 1
    assert joined[0, 0] == joined[0, 1] != joined[0, 2] == joined[0, 3]
    assert found.count + len(found.crossed) == 6


@pytest.mark.parametrize("seed", range(3))
def test_exchanges_keep_the_number_of_cards_and_flyaways(seed):
    rng = np.random.default_rng(seed)
    features, count = rng.random((60, 12), np.float32), 12
    labels = np.concatenate([np.arange(count), rng.integers(0, count, 48)]).astype(np.int32)
    labels[50:] = -1
    clumps = Clumps(labels, np.sort(rng.permutation(count)[:5]))
    for most in (1, 3, 8):
        clumps = exchanged(features, clumps, CardShares(*rng.random((2, 17))), most)
        assert clumps.count + len(clumps.crossed) == 17 and set(clumps.crossed) <= set(range(clumps.count))
        assert np.bincount(clumps.labels[:50], minlength=clumps.count).min() > 0 and (clumps.labels[50:] == -1).all()
