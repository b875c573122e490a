# SPDX-License-Identifier: GPL-3.0-or-later
"""The longitudinal function has unit area and symmetry, and does not overflow."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import i0, i0e

from hair_addon.core.shading.fibre import longitudinal


def test_bessel_function_is_that_of_scipy():
    x = np.concatenate([np.linspace(0.0, 20.0, 2001), np.geomspace(20.0, 1e6, 500)])
    np.testing.assert_allclose(longitudinal.i0e(x), i0e(x), rtol=6e-7)


def lobe(theta_i, theta_o, v):
    return longitudinal.d_eon_lobe(np.sin(theta_i), np.cos(theta_i), np.sin(theta_o), np.cos(theta_o), v)


@pytest.mark.parametrize("v", [1e-4, 0.01, 0.0846, 1.0, 30.0])
@pytest.mark.parametrize("degrees", [0, 40, 80, 90])
def test_lobe_is_of_unit_area(v, degrees):
    """A lobe has unit area over the cosine-weighted inclination, also at grazing light, where a Gaussian loses
    light.
    """
    theta_o = np.radians(degrees)
    sin_i = np.sin(theta_o) * -1.0
    # Cosine-weighted inclination is the sine: dense where the lobe is.
    around = np.arcsin(np.clip(sin_i, -1.0, 1.0))
    theta_i = np.concatenate([np.linspace(-np.pi / 2, np.pi / 2, 20_001), around + np.linspace(-0.2, 0.2, 40_001)])
    theta_i = np.unique(theta_i[np.abs(theta_i) <= np.pi / 2])
    area = np.trapezoid(lobe(theta_i, theta_o, v) * np.cos(theta_i), theta_i)
    assert area == pytest.approx(1.0, abs=1e-5)


@given(st.floats(-1.57, 1.57), st.floats(-1.57, 1.57), st.floats(0.05, 10.0))
def test_lobe_is_the_printed_one_where_that_does_not_overflow(theta_i, theta_o, v):
    c, s = np.cos(theta_i) * np.cos(theta_o), np.sin(theta_i) * np.sin(theta_o)
    printed = np.exp(-s / v) * i0(c / v) / (2.0 * v * np.sinh(1.0 / v))
    assert lobe(theta_i, theta_o, v) == pytest.approx(printed, rel=1e-6)


@given(st.floats(-1.57, 1.57), st.floats(-1.57, 1.57), st.floats(1e-4, 10.0))
def test_lobe_knows_no_difference_between_light_and_viewer(theta_i, theta_o, v):
    assert lobe(theta_i, theta_o, v) == lobe(theta_o, theta_i, v)


def test_narrow_lobe_is_marschner_s_gaussian():
    v, theta_i = 1e-3, np.linspace(-0.1, 0.1, 101)
    gaussian = np.exp(-(theta_i**2) / (2.0 * v)) / np.sqrt(2.0 * np.pi * v)
    np.testing.assert_allclose(lobe(theta_i, 0.0, v), gaussian, rtol=0.02)
