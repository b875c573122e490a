# SPDX-License-Identifier: GPL-3.0-or-later
"""The error of cards is 0 for the strands themselves, falls with the number of cards, and decides placements."""

from dataclasses import replace

import numpy as np
import pytest

from hair_addon.core.cards import best_placement, card_views
from hair_addon.core.cards.card_error import Comparison, card_error
from hair_addon.core.cards.card_layout import CardStrands, Placement
from hair_addon.core.cards.card_settings import CardSettings, Level
from hair_addon.core.geometry.mesh import TriMesh
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
    """The best placement has at most the error of the default one, for the same number of cards."""
    monkeypatch.setattr(best_placement, "_TIP", ())
    monkeypatch.setattr(best_placement, "_OUTWARD", (0.5,))
    tried = []

    def measured(*given):
        tried.append((given[3:], measure(*given)))
        return tried[-1][1]

    measure = best_placement.placement_error
    monkeypatch.setattr(best_placement, "placement_error", measured)
    settings = CardSettings(card_count=40)
    best = best_placement.best_placement(comparison, strands, LEVEL, settings, lambda _step, _part: None)
    least = min(tried, key=lambda trial: trial[1].mean)
    assert best == least[0] and least[1].mean < 0.9 * tried[0][1].mean
    assert tried[0][0] == (settings, Placement()) and len(tried) == 4
    tried.clear()
    given = CardSettings(card_count=40, crossed=0.25)
    best = best_placement.best_placement(comparison, strands, LEVEL, given, lambda _step, _part: None)
    assert best[0] == given and len(tried) == 2  # the settings determine the crossed cards
