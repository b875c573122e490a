# SPDX-License-Identifier: GPL-3.0-or-later
"""Azimuthal roughness is a density, and a matrix that moves light between cells without losing any."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from hair_addon.core.shading.fibre import azimuthal

scales = st.floats(0.006, 4.5)


@given(scales)
def test_trimmed_logistic_is_a_density(scale):
    half, _ = quad(azimuthal.trimmed_logistic, 0.0, np.pi, args=(scale,), points=[min(10.0 * scale, 3.0)])
    assert half == pytest.approx(0.5, abs=1e-9)


def edges_of(axes, count=48):
    u = np.arange(count + 1) / count
    return np.arccos(2.0 * u - 1.0) if axes == "COSINES" else np.pi * u


@pytest.mark.parametrize("axes", ["ANGLES", "COSINES"])
@given(scale=scales)
def test_no_light_is_lost_and_none_is_negative(axes, scale):
    edges = edges_of(axes)
    matrix, widths = azimuthal.roughening(edges, scale), np.abs(np.diff(edges))
    np.testing.assert_allclose(widths @ matrix, widths, rtol=1e-12)
    assert (matrix >= 0.0).all()


@pytest.mark.parametrize("axes", ["ANGLES", "COSINES"])
@given(scale=scales)
def test_even_light_stays_even(axes, scale):
    """Even light stays even, which fails if light from the other side of the circle is omitted or counted twice."""
    np.testing.assert_allclose(azimuthal.roughening(edges_of(axes), scale).sum(axis=1), 1.0, rtol=1e-9)


@pytest.mark.parametrize("scale", [0.05, 0.4, 3.0])
def test_elements_are_means_of_the_density_over_cells(scale):
    """Elements are means of the density over cells, by brute force over pairs of points on both sides of the circle."""
    edges = edges_of("ANGLES", 12)
    inside = (np.arange(200) + 0.5) / 200 * edges[1]
    for row, column in [(0, 0), (0, 11), (5, 7), (11, 11), (11, 3)]:
        to, source = np.meshgrid(edges[row] + inside, edges[column] + inside, indexing="ij")
        mean = 0.0
        for deflection in (to - source, to + source):
            mean += azimuthal.trimmed_logistic((deflection + np.pi) % (2.0 * np.pi) - np.pi, scale).mean()
        found = azimuthal.roughening(edges, scale)[row, column] / edges[1]
        assert found == pytest.approx(mean, rel=1e-3, abs=1e-9)


def test_a_smooth_fibre_is_left_as_it_is():
    np.testing.assert_allclose(azimuthal.roughening(edges_of("ANGLES"), 1e-6), np.eye(48), atol=1e-4)
