# SPDX-License-Identifier: GPL-3.0-or-later
"""Styles fitted to a surface: lengths follow its size, and nothing else does."""

import pytest

from hair_addon.core.params import declared
from hair_addon.core.styling import clump, fitting
from hair_addon.core.styling.kinds import OFFERS

FACTORS = (0.1, 0.37, 1.0, 3.3, 25.0)


@pytest.mark.parametrize("offer", OFFERS)
@pytest.mark.parametrize("factor", FACTORS)
def test_lengths_are_multiplied_within_their_ranges_and_the_rest_stays(offer, factor):
    settings = OFFERS[offer].settings
    fitted = fitting.fitted(settings, factor)
    for name, _default, details in declared(type(settings)):
        before, after = getattr(settings, name), getattr(fitted, name)
        if details.unit == "LENGTH":
            assert after == pytest.approx(min(max(before * factor, details.low), details.high), rel=5e-3)
        else:
            assert after == before


@pytest.mark.parametrize("offer", OFFERS)
def test_a_human_head_changes_nothing(offer):
    settings = OFFERS[offer].settings
    assert fitting.fitted(settings, 1.0) == settings


@pytest.mark.parametrize("spacing", [0.0, 0.001, 0.01, 2.0])
def test_locks_are_four_spacings_at_least(spacing):
    size = fitting.fitted(clump.Settings(size=0.012), 1.0, spacing).size
    assert size == pytest.approx(max(0.012, 4.0 * spacing))
