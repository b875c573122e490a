# SPDX-License-Identifier: GPL-3.0-or-later
"""Fresnel's equations hold at their known points, and inclined rays are flattened correctly."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hair_addon.core.shading.fibre.fresnel import bravais_indices, bravais_reflectance, dielectric_reflectance

indices = st.floats(1.01, 3.0)
cosines = st.floats(0.001, 1.0)


@given(indices)
def test_normal_incidence(eta):
    assert dielectric_reflectance(1.0, eta) == pytest.approx(((eta - 1.0) / (eta + 1.0)) ** 2)


@given(indices)
def test_grazing_light_is_reflected_whole(eta):
    assert dielectric_reflectance(0.0, eta) == pytest.approx(1.0)


@given(indices)
def test_brewster_s_angle_leaves_half_of_one_polarisation(eta):
    cosine = np.cos(np.arctan(eta))
    perpendicular = ((1.0 - eta**2) / (1.0 + eta**2)) ** 2
    assert dielectric_reflectance(cosine, eta) == pytest.approx(0.5 * perpendicular)


@given(indices, cosines)
def test_reflectance_is_the_same_from_both_sides(eta, cosine):
    beyond = np.sqrt(1.0 - (1.0 - cosine**2) / eta**2)
    assert dielectric_reflectance(beyond, 1.0 / eta) == pytest.approx(dielectric_reflectance(cosine, eta), abs=1e-9)


def test_light_beyond_the_critical_angle_stays_inside():
    critical = np.sqrt(1.0 - 1.0 / 1.55**2)
    assert np.all(dielectric_reflectance(np.linspace(0.01, critical - 1e-6, 20), 1.0 / 1.55) == 1.0)
    assert dielectric_reflectance(critical + 1e-3, 1.0 / 1.55) < 1.0


@given(indices, cosines)
def test_bravais_indices_multiply_to_eta_squared_and_meet_in_the_normal_plane(eta, cos_theta_d):
    eta_prime, eta_double_prime = bravais_indices(cos_theta_d, eta)
    assert eta_prime * eta_double_prime == pytest.approx(eta**2)
    assert eta_prime >= eta * (1.0 - 1e-12)
    assert bravais_indices(1.0, eta) == pytest.approx((eta, eta))


@given(indices, st.floats(-1.57, 1.57), st.floats(-1.57, 1.57))
def test_bravais_index_bends_the_flat_ray_as_snell_bends_the_inclined_one(eta, theta_d, gamma):
    incoming = np.array([np.cos(theta_d) * np.cos(gamma), np.cos(theta_d) * np.sin(gamma), np.sin(theta_d)])
    tangential = incoming[1:] / eta  # Snell's law: what lies in the surface is divided by eta
    refracted_flat = np.array([np.sqrt(1.0 - tangential @ tangential), tangential[0]])
    eta_prime, _ = bravais_indices(np.cos(theta_d), eta)
    sin_gamma_t = refracted_flat[1] / np.linalg.norm(refracted_flat)
    assert sin_gamma_t == pytest.approx(np.sin(gamma) / eta_prime, abs=1e-12)


@given(indices, cosines, st.floats(-1.57, 1.57))
def test_flat_reflectance_is_that_of_the_inclined_ray(eta, cos_theta_d, gamma):
    """The flat reflectance is that of the inclined ray, which fails if the second polarization is refracted by
    eta''.
    """
    eta_prime, eta_double_prime = bravais_indices(cos_theta_d, eta)
    cos_gamma_t = np.sqrt(1.0 - (np.sin(gamma) / eta_prime) ** 2)
    flat = bravais_reflectance(np.cos(gamma), cos_gamma_t, eta_prime, eta_double_prime)
    assert flat == pytest.approx(dielectric_reflectance(cos_theta_d * np.cos(gamma), eta), abs=1e-12)
