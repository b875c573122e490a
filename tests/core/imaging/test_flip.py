# SPDX-License-Identifier: GPL-3.0-or-later
"""FLIP has the values of the paper's equations for pictures of one color, and is 0 for equal pictures."""

import math

import numpy as np
import pytest

from hair_addon.core.imaging.flip import flip

# CIE L*a*b* of sRGB's primaries under D65, from published tables.
GREEN, BLUE, RED, WHITE, BLACK = (
    (87.735, -86.183, 83.179),
    (32.297, 79.188, -107.860),
    (53.241, 80.092, 67.203),
    (100.0, 0.0, 0.0),
    (0.0, 0.0, 0.0),
)


def expected(one, other):
    """Return the color error of [Andersson20]: HyAB of Hunt-adjusted colors, to the power 0.7, then in two pieces."""

    def distance(first, second):
        (light, a, b), (dark, c, d) = ([x[0], 0.01 * x[0] * x[1], 0.01 * x[0] * x[2]] for x in (first, second))
        return (abs(light - dark) + math.hypot(a - c, b - d)) ** 0.7

    most, error = distance(GREEN, BLUE), distance(one, other)
    if error < 0.4 * most:
        return 0.95 * error / (0.4 * most)
    return 0.95 + 0.05 * (error - 0.4 * most) / (0.6 * most)


def plain(color):
    return np.broadcast_to(np.array(color, float), (12, 9, 3))


@pytest.mark.parametrize(
    ("one", "other", "wanted"),
    [
        ((0, 0, 0), (1, 1, 1), expected(BLACK, WHITE)),
        ((1, 0, 0), (0, 1, 0), expected(RED, GREEN)),
        ((0, 1, 0), (0, 0, 1), 1.0),
        ((1, 0, 0), (0, 0, 0), expected(RED, BLACK)),
        # Y = ((0.5 + 0.055) / 1.055)^2.4 = 0.21404 has L* = 116 ∛Y - 16 = 53.389.
        ((0.5, 0.5, 0.5), (0, 0, 0), expected((53.389, 0.0, 0.0), BLACK)),
    ],
)
def test_pictures_of_one_color_have_the_error_of_the_equations(one, other, wanted):
    np.testing.assert_allclose(flip(plain(one), plain(other)), wanted, atol=2e-4)


def test_black_and_white_have_nearly_the_largest_error():
    """The error of black and white, 0.967, is computed by hand: 100^0.7 = 25.119 of 41.3."""
    assert flip(plain((0, 0, 0)), plain((1, 1, 1))).mean() == pytest.approx(0.967, abs=1e-3)


def test_equal_pictures_have_no_error_and_errors_are_symmetric(rng):
    one, other = rng.random((2, 40, 30, 3))
    assert flip(one, one).max() == 0.0
    np.testing.assert_allclose(flip(one, other), flip(other, one), atol=1e-12)


def test_a_shifted_edge_is_an_error_only_where_it_was_or_is(rng):
    """Pixels farther from an edge than the filters reach have no error."""
    one, other = np.zeros((2, 60, 90, 3))
    one[:, :45], other[:, :48] = 1.0, 1.0
    error = flip(one, other)
    assert error[:, 45:48].min() > 0.8 and error[:, :30].max() < 1e-9 and error[:, 62:].max() < 1e-9
