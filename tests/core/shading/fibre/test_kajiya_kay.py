# SPDX-License-Identifier: GPL-3.0-or-later
"""Kajiya and Kay's cylinder has a mirror cone and conserves energy."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hair_addon.core.errors import HairError
from hair_addon.core.shading.fibre import kajiya_kay
from hair_addon.core.shading.fibre.angles import direction

TANGENT, NORMAL = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])

inclinations = st.floats(-1.5, 1.5)


def specular(theta_i, theta_o, phi, exponent=40.0):
    to_light, to_view = direction(TANGENT, NORMAL, theta_i, 0.0), direction(TANGENT, NORMAL, theta_o, phi)
    return kajiya_kay.kajiya_kay_specular(TANGENT, to_light, to_view, exponent)


@given(inclinations, st.floats(-np.pi, np.pi))
def test_highlight_lies_on_the_mirror_cone(theta_i, phi):
    theta_o = np.linspace(-np.pi / 2, np.pi / 2, 721)
    brightest = theta_o[np.argmax(specular(theta_i, theta_o, phi))]
    assert abs(brightest + theta_i) <= np.pi / 720
    assert specular(theta_i, -theta_i, phi) == pytest.approx(1.0)


@given(inclinations, inclinations)
def test_highlight_does_not_depend_on_the_azimuth(theta_i, theta_o):
    around = specular(theta_i, theta_o, np.linspace(-np.pi, np.pi, 50))
    np.testing.assert_allclose(around, around[0], atol=1e-9)


def test_highlight_never_exceeds_one_and_is_never_negative(rng):
    vectors = rng.normal(size=(3, 5000, 3))
    vectors /= np.linalg.norm(vectors, axis=-1, keepdims=True)
    values = kajiya_kay.kajiya_kay_specular(*vectors, 3.0)
    assert values.min() >= 0.0
    assert values.max() <= 1.0 + 1e-9


def test_light_along_the_fibre_gives_no_diffuse_light_and_light_across_gives_most():
    assert kajiya_kay.kajiya_kay_diffuse(TANGENT, TANGENT) == 0.0
    assert kajiya_kay.kajiya_kay_diffuse(TANGENT, NORMAL) == 1.0


def test_diffuse_colour_is_an_albedo():
    """A fiber without highlight in a white surrounding sends back its diffuse color in every direction."""
    settings = kajiya_kay.Settings(diffuse_color=(0.9, 0.5, 0.1), specular_color=(0.0, 0.0, 0.0))
    theta = (np.arange(2000) + 0.5) / 2000 * np.pi - np.pi / 2
    to_light = direction(TANGENT, NORMAL, theta, np.zeros_like(theta))
    radiance = kajiya_kay.kajiya_kay(TANGENT, to_light, NORMAL, settings)
    integral = 2.0 * np.pi * np.sum(radiance * np.cos(theta)[:, None], axis=0) * np.pi / 2000
    np.testing.assert_allclose(integral, settings.diffuse_color, rtol=1e-5)


@pytest.mark.parametrize(
    "wrong", [{"exponent": 0.0}, {"exponent": np.nan}, {"diffuse_color": (1.1, 0, 0)}, {"specular_color": (-0.1, 0, 0)}]
)
def test_impossible_settings_are_refused(wrong):
    with pytest.raises(HairError):
        kajiya_kay.Settings(**wrong)
