# SPDX-License-Identifier: GPL-3.0-or-later
"""The error of cards is 0 for the strands themselves, falls with the number of cards, and decides placements."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from hair_addon.core.cards import best_placement, card_views, strand_sample
from hair_addon.core.cards.card_error import CardError, CardShares, Comparison, card_error
from hair_addon.core.cards.card_exchange import exchanged
from hair_addon.core.cards.card_layout import CardStrands, Clumps, Placement, clumps_of
from hair_addon.core.cards.card_settings import CardSettings, Level
from hair_addon.core.geometry.mesh import TriMesh
from hair_addon.core.geometry.search.clusters import strand_features
from hair_addon.core.long_work import no_progress
from tests.core.cards.conftest import sphere, wavy_hair
from tests.support.pairs import share_of_rows

SAMPLES = 128  # fewer than the default take less time
LEVEL, SMALL = Level(40, 6, 256), Level(20, 6, 128)


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


@pytest.fixture
def trials(comparison, strands, monkeypatch):
    """Return the `Trials` of a sample of 100 of 400 strands, for up to 20 cards."""
    monkeypatch.setattr(best_placement, "SAMPLES", SAMPLES)
    monkeypatch.setattr(strand_sample, "MOST_STRANDS", 100)
    monkeypatch.setattr(strand_sample, "MOST_POINTS", 7)
    return best_placement.Trials(strands, comparison, 20)


def minimized(trials, progress=no_progress, **changes):
    """Return (chosen, default) pairs of settings and placement of 20 cards."""
    settings = CardSettings(card_count=20, **changes)
    return best_placement.best_placement(trials, SMALL, settings, progress), (settings, Placement())


@pytest.mark.long
@pytest.mark.parametrize("crossed", [0.0, 0.25])
def test_a_chosen_placement_of_a_sample_has_less_error_of_all_strands(trials, crossed, monkeypatch):
    """From the sides of the search and from others, with as many cards and the given part of crossed cards."""
    monkeypatch.setattr(best_placement, "MOST_EXCHANGES", 5)
    best, default = minimized(trials, crossed=crossed)
    found, most = (trials.errors_of_all(SMALL, *choice) for choice in (best, default))
    assert (found <= most).all() and (crossed or found[0] < 0.95 * most[0])
    assert best[1].clumps is None or best[1].clumps.count + len(best[1].clumps.crossed) == 20
    assert crossed in {0.0, best[0].crossed}


def test_the_number_of_trials_and_their_strands_is_bounded(trials, monkeypatch):
    """Also if each trial has less error than all before, and the result is no better for all strands."""
    drawn, levels = [], iter(np.linspace(0.9, 0.1, 99))
    shares = CardShares(*np.random.default_rng(0).random((2, 20)))

    def measured(*_given):
        return CardError(0.0, next(levels))

    monkeypatch.setattr(best_placement, "_drawn", lambda its, *_given: drawn.append(len(its.points)) or (its, {}))
    monkeypatch.setattr(trials.seen, "error_of", measured)
    monkeypatch.setattr(trials.held, "error_of", measured)
    monkeypatch.setattr(trials.seen, "shares_of", lambda *_given: (measured(), shares))
    monkeypatch.setattr(trials, "_of_all", [SimpleNamespace(error_of=lambda *_drawn: CardError(0.0, len(drawn)))])
    steps = []
    best, default = minimized(trials, lambda step, part: steps.append((part, step)))
    assert best == default
    assert steps == sorted(steps) and steps[0][0] == 0.0 and 0.9 < steps[-1][0] < 1.0
    assert drawn.count(400) == 3 and drawn.count(100) == len(drawn) - 3 <= 19


def test_a_placement_that_is_worse_from_other_sides_is_not_used(trials, monkeypatch):
    """Crossed cards seem best for the sample. They are used if neither error of all strands is larger."""
    placement, errors = Placement(tip=4.0), {0.0: [0.2, 0.2], 1.0: [0.1, 0.3]}
    monkeypatch.setattr(best_placement, "_exchanging", lambda *_given: placement)
    monkeypatch.setattr(trials, "errors_of_all", lambda _level, its, _placement: np.array(errors[its.crossed]))
    monkeypatch.setattr(best_placement, "placement_error", lambda *given: CardError(0.0, 1.0 - given[3].crossed))
    best, default = minimized(trials)
    assert best == default
    errors[1.0] = [0.1, 0.2]
    assert minimized(trials)[0] == (replace(default[0], crossed=1.0), placement)


def test_exchanges_that_seem_worse_from_other_sides_are_not_accepted(trials, monkeypatch):
    falling, rising = iter(np.linspace(0.9, 0.1, 20)), iter(np.linspace(0.1, 0.9, 20))
    shares = CardShares(*np.random.default_rng(0).random((2, 20)))
    monkeypatch.setattr(best_placement, "_drawn", lambda *_given: (None, None))
    monkeypatch.setattr(trials.seen, "shares_of", lambda *_given: (CardError(0.0, next(falling)), shares))
    monkeypatch.setattr(trials.held, "error_of", lambda *_drawn: CardError(0.0, next(rising)))
    assert best_placement._exchanging(trials, SMALL, CardSettings(), Placement(), lambda _index: None) is None
    assert next(rising) > 0.2  # several were tried


def test_a_sample_covers_as_much_as_all_strands(strands, monkeypatch):
    monkeypatch.setattr(strand_sample, "MOST_STRANDS", 100)
    sample = strand_sample.sample_of(strands, 10)
    assert len(sample.rows) == 100 and (np.diff(sample.rows) > 0).all()
    everywhere, some = (np.linalg.norm(np.diff(its.points, axis=1), axis=-1) for its in (strands, sample.strands))
    areas = [(length * its.radii[:, 1:]).sum() for length, its in ((everywhere, strands), (some, sample.strands))]
    assert areas[1] == pytest.approx(areas[0], rel=0.05)
    assert len(strand_sample.sample_of(strands, 50).rows) == 200  # four for each card
    assert len(strand_sample.sample_of(strands, 400).rows) == 400


def test_clumps_of_a_sample_become_clumps_of_all_strands(strands, monkeypatch):
    """Sampled strands keep their clump, flyaways keep their number, and other strands join the most similar clump."""
    monkeypatch.setattr(strand_sample, "MOST_STRANDS", 100)
    sample = strand_sample.sample_of(strands, 10)
    clumps = clumps_of(sample.strands, LEVEL, CardSettings(crossed=0.3, flyaways=0.2), Placement())
    found = strand_sample.of_all(Placement(clumps=clumps), strands, sample.rows).clumps
    np.testing.assert_array_equal(found.labels[sample.rows], clumps.labels)
    assert (found.labels < 0).sum() == (clumps.labels < 0).sum() == 8
    features, chosen = strand_features(strands.points), sample.rows[clumps.labels >= 0]
    kept = found.labels[chosen]
    middles = np.array([features[chosen[kept == clump]].mean(axis=0) for clump in range(clumps.count)])
    rest = np.setdiff1d(np.arange(400), sample.rows)
    apart = ((features[rest, None] - middles) ** 2).sum(axis=-1)
    np.testing.assert_array_equal(found.labels[rest], apart.argmin(axis=1))


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
