# SPDX-License-Identifier: GPL-3.0-or-later
"""Angles about a fiber are computed from directions and back, and have their symmetries."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from hair_addon.core.shading.fibre import angles

TANGENT, NORMAL = np.array([0.0, 0.6, 0.8]), np.array([1.0, 0.0, 0.0])

inclinations = st.floats(-1.57, 1.57)
azimuths = st.floats(-3.14, 3.14)


def directions(rng, count):
    vectors = rng.normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


@given(inclinations, inclinations, azimuths, azimuths)
def test_angles_survive_the_way_to_directions_and_back(theta_i, theta_o, phi_i, phi):
    to_light = angles.direction(TANGENT, NORMAL, theta_i, phi_i)
    to_view = angles.direction(TANGENT, NORMAL, theta_o, phi_i + phi)
    found = angles.fibre_angles(TANGENT, to_light, to_view)
    np.testing.assert_allclose([found.theta_i, found.theta_o], [theta_i, theta_o], atol=1e-7)
    # Near the tangent the azimuth is a quotient of two small lengths.
    np.testing.assert_allclose(found.phi, phi, atol=1e-14 / (np.cos(theta_i) * np.cos(theta_o)))


def test_the_azimuth_looks_back_at_the_light_at_zero_and_straight_through_at_pi():
    assert angles.relative_azimuth(TANGENT, NORMAL, NORMAL) == 0.0
    assert abs(angles.relative_azimuth(TANGENT, NORMAL, -NORMAL)) == np.pi


def test_a_direction_along_the_tangent_gives_finite_angles():
    found = angles.fibre_angles(TANGENT, TANGENT, NORMAL)
    assert np.isfinite([found.theta_i, found.theta_o, found.phi, found.theta_h, found.theta_d]).all()
    np.testing.assert_allclose(found.theta_i, np.pi / 2, atol=1e-7)


def test_exchanging_light_and_viewer_turns_phi_and_theta_d_around(rng):
    tangent, light, view = (directions(rng, 200) for _ in range(3))
    there, back = angles.fibre_angles(tangent, light, view), angles.fibre_angles(tangent, view, light)
    np.testing.assert_allclose(back.phi, -there.phi, atol=1e-12)
    np.testing.assert_allclose(back.theta_d, -there.theta_d, atol=1e-12)
    np.testing.assert_allclose(back.theta_h, there.theta_h, atol=1e-12)


@given(inclinations, inclinations)
def test_cosine_of_theta_d_needs_no_inverse_function(theta_i, theta_o):
    found = angles.cos_theta_d(np.sin(theta_i), np.sin(theta_o))
    np.testing.assert_allclose(found, np.cos(0.5 * (theta_o - theta_i)), atol=2e-8)


def test_rounding_beyond_one_is_forgiven():
    assert angles.sin_from_cos(1.0000001) == 0.0
    assert angles.inclination(-1.0000001) == -np.pi / 2
    assert np.isfinite(angles.cos_theta_d(1.0000001, -1.0000001))
