# SPDX-License-Identifier: GPL-3.0-or-later
"""Pigment and color agree with absorption by published values, in both directions."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hair_addon.core.shading.fibre import pigment


@given(st.floats(1e-3, 0.999), st.floats(0.0, 1.0))
def test_colour_survives_the_way_to_absorption_and_back(component, roughness):
    color = np.array([component, 0.5, 0.02])
    back = pigment.color_from_sigma_a(pigment.sigma_a_from_color(color, roughness), roughness)
    np.testing.assert_allclose(back, color, rtol=1e-9)


@pytest.mark.parametrize("color", [(0.0, 0.0, 0.0), (1.0, 1.0, 1.0), (-1.0, 2.0, 0.5)])
def test_impossible_colours_give_finite_absorption(color):
    sigma_a = pigment.sigma_a_from_color(np.array(color))
    assert np.isfinite(sigma_a).all()
    assert (sigma_a >= 0.0).all()


def test_no_pigment_absorbs_nothing_and_all_of_it_absorbs_finitely():
    np.testing.assert_array_equal(pigment.sigma_a_from_melanin(0.0, 0.5), 0.0)
    assert np.isfinite(pigment.sigma_a_from_melanin(1.0, 0.5)).all()


@given(st.floats(0.0, 0.99), st.floats(0.0, 1.0))
def test_more_melanin_absorbs_more_and_blue_most(melanin, redness):
    less, more = pigment.sigma_a_from_melanin(melanin, redness), pigment.sigma_a_from_melanin(melanin + 0.005, redness)
    assert (more > less).all()
    assert more[0] < more[1] < more[2]


@pytest.mark.parametrize(("melanin", "concentration"), [(0.220, 0.3), (0.659, 1.3), (0.9987, 8.0)])
def test_blond_brown_and_black_have_the_published_eumelanin(melanin, concentration):
    """Blond, brown and black hair have the eumelanin of [DEon11] at its absorption, which Cycles' scale exceeds by
    1.207.
    """
    published = concentration * np.array([0.419, 0.697, 1.37])
    np.testing.assert_allclose(pigment.sigma_a_from_melanin(melanin, 0.0), published, rtol=0.01)


@given(st.floats(1e-3, 0.9), st.floats(0.0, 1.0))
def test_darker_hair_absorbs_more_and_a_colour_bleached_white_nothing(component, roughness):
    dark, light = (pigment.sigma_a_from_color(c, roughness) for c in (component, 1.05 * component))
    assert dark > light
    assert pigment.color_from_sigma_a(0.0, roughness) == 1.0


def test_smooth_fibres_follow_the_published_fit():
    """Smooth fibers follow the fit of [Chiang16] with only its first coefficient: sigma_a = 1 is e^-5.969."""
    assert pigment.color_from_sigma_a(1.0, 0.0) == pytest.approx(np.exp(-5.969))
    assert pigment.color_from_sigma_a(1.0, 1.0) == pytest.approx(np.exp(-3.375))


colors = st.lists(st.floats(0.0, 1.0), min_size=3, max_size=3)


@given(colors, st.floats(1e-6, 10.0), st.floats(1e-6, 10.0))
def test_less_that_is_sent_back_darkens_as_in_a_deep_layer(color, first, second):
    """Less reflected light darkens hair as in a deep layer: K / S differs by the scattering, and two changes combine
    to one.
    """
    color = np.array(color)
    np.testing.assert_allclose(pigment.color_of_scattering(color, 1.0), color, rtol=1e-12, atol=1e-300)
    found = pigment.color_of_scattering(color, first)
    assert ((found >= 0.0) & (found <= 1.0 + 1e-12)).all()
    np.testing.assert_allclose(
        first * np.square(1.0 - found) * color, np.square(1.0 - color) * found, rtol=1e-6, atol=1e-12
    )
    twice = pigment.color_of_scattering(found, second)
    np.testing.assert_allclose(twice, pigment.color_of_scattering(color, first * second), rtol=1e-5, atol=1e-7)
    assert ((found - color) * (first - 1.0) >= -1e-12).all()
