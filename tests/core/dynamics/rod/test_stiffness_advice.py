# SPDX-License-Identifier: GPL-3.0-or-later
"""Bending of guides under their weight, compared with the elastica and linear beam theory."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad, solve_bvp

from hair_addon.core.dynamics.rod.settings import DynamicsSettings
from hair_addon.core.dynamics.rod.stiffness_advice import bend_under_weight, tip_sink, weight_ratio

GRAVITY = 9.81


def elastica(ratio, tip=1.0):
    """Return how far the tip sinks, by collocation of (p θ')' = −Γ (1 − s) cos θ with p = 1 + (tip − 1) s."""

    def slopes(s, y):
        return np.stack([y[1] / (1.0 + (tip - 1.0) * s), -ratio * (1.0 - s) * np.cos(y[0]), np.sin(y[0])])

    s = np.linspace(0.0, 1.0, 201)
    angles = np.minimum(ratio * s / 6.0, 1.5)
    found = solve_bvp(
        slopes,
        lambda root, end: np.array([root[0], end[1], root[2]]),
        s,
        np.stack([angles, 0.0 * s, s * np.sin(angles)]),
        tol=1e-6,
        max_nodes=20_000,
    )
    assert found.status == 0
    return found.y[2, -1]


@pytest.mark.parametrize("ratio", [1e-6, 1e-3, 0.05])
def test_a_stiff_cantilever_sinks_by_an_eighth_of_its_weight_ratio(ratio):
    assert tip_sink(ratio) / ratio == pytest.approx(1.0 / 8.0, rel=2e-3)


@pytest.mark.parametrize("tip", [0.0, 0.25, 4.0])
def test_a_stiff_cantilever_with_another_tip_sinks_as_a_beam_does(tip):
    """The tip of a stiff cantilever with another tip stiffness sinks by ½ Γ ∫ (1 − s)³ / p ds, as a beam does."""
    wanted, _error = quad(lambda s: 0.5 * (1.0 - s) ** 3 / (1.0 + (tip - 1.0) * s), 0.0, 1.0)
    assert tip_sink(1e-5, tip) / 1e-5 == pytest.approx(wanted, rel=5e-3)


@pytest.mark.parametrize("tip", [0.25, 1.0, 4.0])
@pytest.mark.parametrize("ratio", [1.0, 8.0, 60.0])
def test_a_soft_guide_sinks_as_the_elastica(ratio, tip):
    assert tip_sink(ratio, tip) == pytest.approx(elastica(ratio, tip), rel=2e-3)


@given(st.floats(0.0, 1e30), st.floats(1.001, 1e3), st.floats(0.0, 4.0))
def test_heavier_guides_sink_farther_and_never_more_than_they_are_long(ratio, factor, tip):
    lighter, heavier = tip_sink(ratio, tip), tip_sink(ratio * factor, tip)
    assert 0.0 <= lighter <= heavier + 1e-9 <= 1.0 + 2e-9


@given(st.floats(0.1, 10.0), st.floats(0.01, 1.0))
def test_the_weight_ratio_depends_on_what_it_is_made_of(factor, length):
    """Hair bends alike with equal Γ = 4 ρ g L³ / (k E r²): longer by f and thicker by f^1.5, or heavier and stiffer
    by f.
    """
    settings = DynamicsSettings()
    ratio = weight_ratio(settings, length, GRAVITY)
    assert ratio == pytest.approx(4.0 * 1300.0 * GRAVITY * length**3 / (8.0 * 4e9 * 4e-5**2))
    thicker = replace(settings, fibre_radius=settings.fibre_radius * factor**1.5)
    assert weight_ratio(thicker, factor * length, GRAVITY) == pytest.approx(ratio)
    stiffer = replace(settings, weight=factor, bend_stiffness=factor * settings.bend_stiffness)
    assert weight_ratio(stiffer, length, GRAVITY) == pytest.approx(ratio)
    wet = replace(settings, wetness=1.0)
    assert weight_ratio(wet, length, GRAVITY) == pytest.approx(2.6 * ratio)


def test_a_guide_bends_in_its_own_units():
    settings = DynamicsSettings()
    assert bend_under_weight(settings, 0.15, 0.0) == 0.0
    assert bend_under_weight(settings, 0.15, -GRAVITY) == bend_under_weight(settings, 0.15, GRAVITY)
    ratio = weight_ratio(settings, 0.15, GRAVITY)
    assert bend_under_weight(settings, 0.15, GRAVITY) == pytest.approx(0.15 * elastica(ratio), rel=2e-3)
