# SPDX-License-Identifier: GPL-3.0-or-later
"""Styles fitted to a surface scale only lengths with its size."""

from dataclasses import replace

import pytest

from hair_addon.core.params import declared
from hair_addon.core.styling import braid, clump, fitting, wet
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


@pytest.mark.parametrize("offer", OFFERS)
def test_what_is_given_stays(offer):
    settings = OFFERS[offer].settings
    names = [name for name, *_ in declared(type(settings))]
    assert fitting.fitted(settings, 25.0, 2.0, kept=names) == settings
    for kept in names:
        one = fitting.fitted(settings, 25.0, 2.0, kept=[kept])
        assert replace(one, **{kept: getattr(fitting.fitted(settings, 25.0, 2.0), kept)}) == fitting.fitted(
            settings, 25.0, 2.0
        )
        assert getattr(one, kept) == getattr(settings, kept)


@pytest.mark.parametrize("spacing", [0.0, 0.001, 0.01, 2.0])
@pytest.mark.parametrize(
    ("settings", "name"), [(clump.Settings(), "size"), (braid.Settings(), "size"), (wet.Settings(), "lock")]
)
def test_locks_are_four_spacings_at_least(settings, name, spacing):
    size = getattr(fitting.fitted(settings, 1.0, spacing), name)
    assert size == pytest.approx(max(getattr(settings, name), 4.0 * spacing))
