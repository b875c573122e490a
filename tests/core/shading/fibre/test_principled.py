# SPDX-License-Identifier: GPL-3.0-or-later
"""Roughness of Blender's Principled Hair agrees with published widths, in both directions."""

import numpy as np
import pytest

from hair_addon.core.shading.fibre import principled


@pytest.mark.parametrize(("roughness", "degrees"), [(0.1, 2.31), (0.2, 5.09), (0.3, 8.33)])
def test_roughness_gives_the_published_width(roughness, degrees):
    assert np.degrees(principled.beta_r_from_roughness(roughness)) == pytest.approx(degrees, abs=0.01)


@pytest.mark.parametrize("roughness", [0.02, 0.3, 0.77, 0.99])
def test_roughness_survives_the_way_there_and_back(roughness):
    assert principled.roughness_from_beta_r(principled.beta_r_from_roughness(roughness)) == pytest.approx(
        roughness, abs=1e-5
    )


def test_roughness_is_the_published_variance_and_scale():
    """Variance and scale are those of [Chiang16] at 0.3 and 1; theta_i + theta_o has twice the deviation of theta_h."""
    assert principled.variance_from_roughness(0.3) == pytest.approx(0.0846, abs=1e-4)
    assert principled.variance_from_roughness(0.3) == pytest.approx((2.0 * principled.beta_r_from_roughness(0.3)) ** 2)
    assert principled.scale_from_radial_roughness(0.3) == pytest.approx(0.1172, abs=1e-4)
    assert principled.scale_from_radial_roughness(1.0) == pytest.approx(4.281, abs=1e-3)


def test_smooth_fibres_keep_a_width_that_single_precision_can_hold():
    roughness = np.linspace(0.0, 1.0, 101)
    for width in (principled.variance_from_roughness, principled.scale_from_radial_roughness):
        assert width(0.0) > 0.0
        assert (np.diff(width(roughness)) >= 0.0).all()


def test_random_roughness_keeps_its_mean_and_its_range():
    random = (np.arange(1000) + 0.5) / 1000
    assert principled.varied_roughness(0.3, 0.5, random).mean() == pytest.approx(0.3)
    np.testing.assert_allclose(principled.varied_roughness(0.4, 0.25, np.array([0.0, 0.5, 1.0])), [0.3, 0.4, 0.5])
    assert principled.varied_roughness(0.9, 1.0, random).max() == 1.0
