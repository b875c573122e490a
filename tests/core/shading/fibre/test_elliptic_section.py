# SPDX-License-Identifier: GPL-3.0-or-later
"""Elliptic sections have the index of [Marschner03], and a circle as their limit."""

from dataclasses import replace

import numpy as np
import pytest

from hair_addon.core.shading.fibre import elliptic_section
from hair_addon.core.shading.fibre.angles import FibreAngles
from hair_addon.core.shading.tables import absorption_slices, lookup_tables

CLASSIC = lookup_tables.Settings(size=64)


def test_a_circle_has_its_own_index_from_every_side():
    np.testing.assert_allclose(elliptic_section.layer_etas(1.55, 1.0), 1.55)


def test_the_published_indices():
    first, *_, last = elliptic_section.layer_etas(1.55, 0.85)
    assert first == pytest.approx(1.245, abs=1e-3) and last == pytest.approx(1.973, abs=1e-3)


def test_weights_say_the_index_that_is_linear_in_the_cosine(rng):
    etas = elliptic_section.layer_etas(1.55, 0.9)
    cosine = np.concatenate([[-1.0, 1.0], rng.uniform(-1.0, 1.0, 200)])
    weights = elliptic_section.layer_weights(cosine)
    np.testing.assert_allclose(weights.sum(axis=-1), 1.0)
    expected = 0.5 * (etas[0] + etas[-1]) + 0.5 * cosine * (etas[0] - etas[-1])
    np.testing.assert_allclose(weights @ etas, expected)


def test_azimuth_from_the_major_axis(rng):
    """The azimuth from the major axis equals the angles in the frame of the fiber."""
    phi_i, phi_o, theta_i, theta_o = rng.uniform(-1.5, 1.5, (4, 300))
    light, view = (
        np.stack([np.cos(t) * np.cos(p), np.cos(t) * np.sin(p), np.sin(t)], axis=-1)
        for t, p in ((theta_i, phi_i), (theta_o, phi_o))
    )
    tangent, axis = (np.broadcast_to(base, light.shape) for base in ([0.0, 0.0, 1.0], [1.0, 0.0, 0.0]))
    found = elliptic_section.cos_twice_phi_h(tangent, axis, light, view)
    np.testing.assert_allclose(found, np.cos(phi_i + phi_o), atol=1e-12)
    # As everything about a fiber, the same in any frame, and when light and viewer change places.
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    turned = elliptic_section.cos_twice_phi_h(tangent @ turn, axis @ turn, view @ turn, light @ turn)
    np.testing.assert_allclose(turned, found, atol=1e-12)


def test_major_axes_lie_across_the_strands_in_every_direction(rng):
    random = rng.random(20_000)
    tangent = np.broadcast_to([0.0, 0.0, 1.0], (20_000, 3))
    axis = elliptic_section.major_axis(tangent, random)
    np.testing.assert_allclose(axis[:, 2], 0.0, atol=1e-12)
    counts, _edges = np.histogram(np.arctan2(axis[:, 1], axis[:, 0]), bins=8)
    np.testing.assert_allclose(counts, 2500, rtol=0.1)


def test_an_almost_circular_fibre_reflects_as_a_circular_one(rng):
    theta_i, theta_o = rng.uniform(-1.2, 1.2, (2, 500))
    at = FibreAngles(theta_i, theta_o, rng.uniform(-np.pi, np.pi, 500))
    sigma_a, cosine = np.full((500, 3), 0.3), rng.uniform(-1.0, 1.0, 500)
    circle = absorption_slices.bake(CLASSIC, (0.3, 0.3), 2)
    assert circle.n_trt is None
    ellipse = absorption_slices.bake(replace(CLASSIC, eccentricity=1.0 - 1e-6), (0.3, 0.3), 2)
    found = absorption_slices.sample_radiance(ellipse, at, sigma_a, cos_twice_phi_h=cosine)
    np.testing.assert_allclose(found, absorption_slices.sample_radiance(circle, at, sigma_a), rtol=1e-3, atol=1e-6)


def test_seen_from_its_axes_an_ellipse_reflects_as_circles_of_their_indices():
    settings = replace(CLASSIC, eccentricity=0.85)
    slices = absorption_slices.bake(settings, (0.3, 0.3), 2)
    for layer, eta in enumerate(elliptic_section.layer_etas(settings.eta, 0.85)):
        n_trt = lookup_tables.azimuthal_lobes(replace(settings, eta=float(eta)), (0.3,))[2]
        np.testing.assert_allclose(slices.n_trt[0, ..., layer], n_trt[..., 0], rtol=1e-6)
    # The energy-conserving mode has no section but the circle.
    assert absorption_slices.bake(replace(settings, mode="energy"), (0.3, 0.3), 2).n_trt is None
