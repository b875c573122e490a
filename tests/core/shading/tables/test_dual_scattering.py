# SPDX-License-Identifier: GPL-3.0-or-later
"""Dual scattering has the forward and backward scattering of one fiber and of many."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hair_addon.core.shading.fibre import azimuthal, marschner, principled
from hair_addon.core.shading.fibre.angles import FibreAngles
from hair_addon.core.shading.fibre.pigment import sigma_a_from_melanin
from hair_addon.core.shading.tables import dual_scattering, lookup_tables
from tests.support.pairs import share_of

PUBLISHED = {  # melanin: a_f, a_b at normal incidence
    0.220: ((0.624, 0.538, 0.380), (0.173, 0.149, 0.109)),
    0.659: ((0.305, 0.174, 0.066), (0.092, 0.063, 0.041)),
    0.9987: ((0.041, 0.040, 0.040), (0.036, 0.036, 0.036)),
}


def baked(mode="energy", sigma_a=(0.1, 0.4, 1.5), **details):
    tables = lookup_tables.bake(lookup_tables.Settings(mode=mode, sigma_a=sigma_a, **details))
    return tables, dual_scattering.bake(tables)


@pytest.mark.parametrize("melanin", PUBLISHED)
def test_hair_passes_on_and_sends_back_the_published_parts(melanin):
    _tables, dual = baked(sigma_a=tuple(sigma_a_from_melanin(melanin, 0.0)))
    for name, expected in zip(("a_f", "a_b"), PUBLISHED[melanin], strict=True):
        np.testing.assert_allclose(dual.at(name, 0.0), expected, atol=1e-3)


@pytest.mark.parametrize("mode", ["energy", "classic"])
def test_what_goes_on_and_what_comes_back_are_all_that_is_scattered(mode):
    """Forward and backward scattering are all scattered light, by the integral of the tables' radiance over the
    sphere.
    """
    tables, _dual = baked(mode, caustic="exact")
    nodes, weights = np.polynomial.legendre.leggauss(200)
    other = 0.5 * np.pi * nodes[:, None]
    phi = (np.arange(256) + 0.5) / 256 * np.pi
    for theta in (0.0, 0.7, -1.2):
        # At a fixed view in the energy mode, whose furnace it is; the classic mode is reciprocal.
        at = FibreAngles(*np.broadcast_arrays(other, theta, phi[None, :]))
        radiance = lookup_tables.sample_radiance(tables, at).mean(axis=1)
        albedo = 2.0 * np.pi * (0.5 * np.pi * weights * np.cos(other[:, 0])) @ radiance
        forward, backward = dual_scattering.scattered_parts(tables, np.array([theta]))
        found = (forward + backward).sum(axis=(0, 1))
        np.testing.assert_allclose(found, albedo, rtol=5e-3)


def test_white_fibres_lose_nothing_and_black_ones_only_reflect():
    white, _ = baked(sigma_a=(0.0, 0.0, 0.0))
    forward, backward = dual_scattering.scattered_parts(white, np.array([0.3]))
    np.testing.assert_allclose((forward + backward).sum(axis=0), 1.0, atol=1e-3)
    black, _ = baked(sigma_a=(100.0, 100.0, 100.0))
    forward, _backward = dual_scattering.scattered_parts(black, np.array([0.3]))
    np.testing.assert_allclose(forward[0], forward.sum(axis=0), rtol=1e-6)


parts = st.tuples(st.floats(0.01, 0.97), st.floats(0.01, 0.5))


@given(parts, st.floats(-0.2, 0.2), st.floats(-0.2, 0.2), st.floats(0.05, 0.3), st.floats(0.05, 0.3))
def test_back_scattering_is_its_series(a, alpha_f, alpha_b, beta_f, beta_b):
    """Back scattering equals its series, summed by events: light goes i strands deep, turns, and returns through i
    strands.
    """
    a_f, a_b = a
    i = np.arange(1, 3000)
    # One turn: i forward events in, i out. Three turns: i in and j, k between, any of which may be nought.
    once = a_b * a_f ** (2.0 * i)
    count = i * (i + 1) / 2.0  # ways to have i pairs of forward events in three stretches, the first not empty
    thrice = a_b**3 * a_f ** (2.0 * i) * count
    total = (once + thrice).sum()
    shift = (once * (alpha_b + 2 * i * alpha_f) + thrice * (3 * alpha_b + 2 * i * alpha_f)).sum() / total
    variance = (once * (beta_b**2 + 2 * i * beta_f**2) + thrice * (3 * beta_b**2 + 2 * i * beta_f**2)).sum() / total
    found = dual_scattering.back_scattering(*map(np.float64, (a_f, a_b, alpha_f, alpha_b, beta_f, beta_b)))
    np.testing.assert_allclose(found, [total, shift, np.sqrt(variance)], rtol=1e-6, atol=1e-9)


def test_published_approximation_of_the_width_is_near():
    """The width is near the published approximation sigma_b of [Zinke08], which is fitted to the series."""
    a_f, a_b, beta_f, beta_b = np.float64(0.5), np.float64(0.12), 0.1, 0.15
    _back, _shift, width = dual_scattering.back_scattering(a_f, a_b, 0.0, 0.0, beta_f, beta_b)
    published = (
        (1.0 + 0.7 * a_f**2)
        * (a_b * np.sqrt(2 * beta_f**2 + beta_b**2) + a_b**3 * np.sqrt(2 * beta_f**2 + 3 * beta_b**2))
        / (a_b + a_b**3 * (2 * beta_f + 3 * beta_b))
    )
    assert width == pytest.approx(published, rel=0.12)


@pytest.mark.parametrize("mode", ["energy", "classic"])
def test_every_quantity_is_finite_and_light_does_not_grow(mode):
    for sigma_a in ((0.0, 0.0, 0.0), (0.1, 1.0, 1000.0)):
        _tables, dual = baked(mode, sigma_a, size=64)
        assert np.isfinite(lookup_tables.to_half(dual.theta)).all()
        assert (dual.at("a_f", 0.0) < 1.0).all() and (dual.theta[:2] >= 0.0).all()


def test_shifts_and_widths_lie_between_those_of_the_lobes():
    tables, dual = baked(tilt=0.1)
    alpha, _beta = np.transpose(marschner.longitudinal_lobes(tables.settings))
    for name in ("alpha_f", "alpha_b"):
        assert (dual.at(name, 0.0) >= alpha.min()).all() and (dual.at(name, 0.0) <= alpha.max()).all()
    # Backward go R and TRT, which turn away from each other; forward goes TT.
    assert dual.at("alpha_f", 0.0)[0] == pytest.approx(0.05, abs=0.02)


def test_light_scattered_forward_comes_from_around_its_direction():
    edges = np.pi * np.arange(33) / 32
    matrix = azimuthal.forward_mean(edges)
    centre = 0.5 * (edges[1:] + edges[:-1])
    n = np.exp(np.cos(centre))
    around = np.linspace(-np.pi / 2, np.pi / 2, 20_001)
    weights = np.square(np.cos(around))
    expected = [np.average(np.exp(np.cos(phi + around)), weights=weights) for phi in centre]
    np.testing.assert_allclose(matrix @ n, expected, rtol=1e-3)


@pytest.mark.parametrize("melanin", [0.02, 0.220, 0.659])
def test_light_that_one_fibre_scatters_forward_is_as_narrow_as_the_tables_take_it(melanin):
    tables, _dual = baked(sigma_a=tuple(sigma_a_from_melanin(melanin, 0.0)))
    edges = lookup_tables.phi_edges(tables.settings)
    phi = 0.5 * (edges[1:] + edges[:-1])
    ahead = np.abs(np.diff(edges)) * phi / np.pi
    rows = [np.eye(tables.settings.size)[-1:]] * 4  # across the fiber
    energy, moment = (
        dual_scattering.lobe_albedos(tables.lobes, ahead * weight, rows).sum(axis=0)[0]
        for weight in (np.ones_like(phi), -np.cos(phi))
    )
    assert (moment / energy)[0] == pytest.approx(8.0 / (3.0 * np.pi), abs=0.06)


parts_of_hair = st.floats(0.01, 0.8), st.floats(0.01, 0.19)


@given(*parts_of_hair, st.floats(0.0, 9.0), st.floats(0.0, 9.0))
def test_fluxes_solve_their_equations(a_f, a_b, front, behind):
    """Fluxes solve the equations of Kubelka and Munk: a thin layer takes what it does not transmit, and adds what
    turns.
    """
    step = 1e-4

    def at(depth):
        return np.concatenate(
            dual_scattering.fluxes(*np.array([depth, front + behind - depth]), *np.array([[a_f], [a_b]]))
        )

    onward, backward = at(front)
    slopes = (at(front + step) - at(front - step)) / (2.0 * step)
    expected = -(1.0 - a_f) * onward + a_b * backward, (1.0 - a_f) * backward - a_b * onward
    np.testing.assert_allclose(slopes, expected, rtol=1e-4, atol=1e-7)
    assert at(front + behind)[1] == pytest.approx(0.0, abs=1e-12)  # nothing comes from behind the last
    assert at(0.0)[0] == pytest.approx(1.0)


def test_without_strands_behind_and_in_front_nothing_is_sent_back():
    onward, backward = dual_scattering.fluxes(0.0, 0.0, np.full(3, 0.76), np.full(3, 0.22))
    np.testing.assert_allclose([onward, backward], [np.ones(3), np.zeros(3)], atol=1e-12)


def test_lossless_hair_loses_nothing():
    """Lossless hair loses no light: what does not pass a layer returns."""
    deep = dual_scattering.deep_hair(np.full(3, 0.75), np.full(3, 0.25))
    for count in (0.5, 4.0, 30.0):
        assert np.sum(dual_scattering.layer_parts(count, *deep), axis=0) == pytest.approx(np.ones(3), abs=0.03)


def directions(rng, count):
    theta_i, theta_o = rng.uniform(-1.3, 1.3, (2, count))
    return FibreAngles(theta_i, theta_o, rng.uniform(-np.pi, np.pi, count))


def test_a_lone_strand_is_lit_as_one(rng):
    tables, dual = baked(size=64)
    at = directions(rng, 200)
    found = dual_scattering.sample_radiance(tables, dual, at, np.zeros(200), np.zeros(200))
    np.testing.assert_allclose(found, lookup_tables.sample_radiance(tables, at), rtol=1e-12)


def test_deeper_strands_are_darker_and_of_purer_colour(rng):
    """Deeper strands are darker and of purer color over all directions, although single lobes may gain from spread
    light.
    """
    tables, dual = baked(size=64)
    at = directions(rng, 4000)
    weights = np.cos(at.theta_i) * np.cos(at.theta_o)
    means = np.array(
        [
            np.average(
                dual_scattering.sample_radiance(tables, dual, at, np.full(4000, n), np.full(4000, 5.0)),
                axis=0,
                weights=weights,
            )
            for n in (1.0, 2.0, 5.0, 10.0)
        ]
    )
    assert (np.diff(means, axis=0) < 0.0).all()
    assert (np.diff(means[:, 0] / means[:, 2]) > 0.0).all()


def test_a_white_strand_deep_in_white_hair_passes_on_what_it_receives():
    """A white strand deep in white hair passes on all received light: its lobes over all views have the energy of
    the row.
    """
    tables, dual = baked(sigma_a=(0.0, 0.0, 0.0), tilt=0.0)
    unit = replace(dual, theta=dual.theta.copy())
    unit.theta[dual_scattering.QUANTITIES.index("a_f")] = 1.0
    unit.theta[dual_scattering.QUANTITIES.index("a_b")] = 0.0
    # A width that differs from light to light is of unit area over the views of each, not over the lights of one.
    unit.theta[dual_scattering.QUANTITIES.index("beta_f")] = 0.1
    nodes, weights = np.polynomial.legendre.leggauss(200)
    theta_i = 0.5 * np.pi * nodes[:, None]
    phi = (np.arange(128) + 0.5) / 128 * np.pi
    at = FibreAngles(*np.broadcast_arrays(theta_i, 0.4, phi[None, :]))
    count = np.full(at.phi.shape, 4.0)
    radiance = dual_scattering.sample_radiance(tables, unit, at, count, np.zeros_like(count))
    returned = 2.0 * np.pi * np.sum(radiance[..., 0].mean(axis=1) * np.cos(theta_i[:, 0]) * weights * 0.5 * np.pi)
    assert returned == pytest.approx(np.exp(-4.0 * dual_scattering._LEAST_ATTENUATION), abs=2e-3)


def moments(theta, radiance):
    """Return (energy over theta and phi, mean, deviation) of radiance (T, F) for every phi in [0, pi]."""
    weights = radiance.mean(axis=1) * np.cos(theta)
    mean = np.average(theta, weights=weights)
    energy = 2.0 * np.pi * weights.sum() * (theta[1] - theta[0])
    return energy, mean, np.sqrt(np.average((theta - mean) ** 2, weights=weights))


@pytest.mark.parametrize("strand_count", share_of([0.0, 3.0], 2))
def test_lobes_are_as_bright_as_wide_and_as_shifted_as_the_tables_say(strand_count):
    """Lobes have the brightness, width and shift of the tables, tested for R of a black fiber and for the backward
    lobe.
    """
    tables, dual = baked(sigma_a=(100.0, 100.0, 100.0), tilt=0.0, roughness=0.1)
    numbers = {"a_f": 0.8, "a_b": 0.1, "beta_f": 0.03, "beta_b": 0.05, "alpha_f": 0.002, "alpha_b": 0.004}
    for name, number in numbers.items():
        dual.theta[dual_scattering.QUANTITIES.index(name)] = number
    quantity = {name: np.full(3, number) for name, number in numbers.items()}
    theta_i, phi = np.linspace(-1.2, 1.2, 2001), (np.arange(64) + 0.5) / 64 * np.pi
    at = FibreAngles(*np.broadcast_arrays(theta_i[:, None], 0.0, phi[None, :]))
    count = np.full(at.phi.shape, strand_count)

    alone = dual_scattering.sample_radiance(tables, dual, at, count, np.zeros_like(count))[..., 0]
    unscattered = np.exp(-strand_count) * lookup_tables.sample_radiance(tables, at)[..., 0]
    if strand_count:
        (turned, spread), _none = dual_scattering.drifts(strand_count, 0.0, quantity)
        _energy, mean, deviation = moments(theta_i, alone - unscattered)
        assert mean == pytest.approx(turned, abs=1e-3)
        assert deviation == pytest.approx(np.sqrt(principled.variance_from_roughness(0.1) + spread), rel=0.03)
    else:
        np.testing.assert_allclose(alone, unscattered, rtol=1e-6)

    dark = replace(tables, n=0.0 * tables.n, n_trt=0.0 * tables.n_trt, n_res=0.0 * tables.n_res)
    dark_dual = replace(dual, n_g=0.0 * dual.n_g, n_g_trt=0.0 * dual.n_g_trt)
    behind = np.full_like(count, 3.0)
    returned = dual_scattering.sample_radiance(dark, dark_dual, at, count, behind)[..., 0]
    _onward, backward = dual_scattering.fluxes(strand_count, 3.0, quantity["a_f"], quantity["a_b"])
    _through, (turned, spread) = dual_scattering.drifts(strand_count, 3.0, quantity)
    energy, mean, deviation = moments(theta_i, returned)
    assert energy == pytest.approx(backward[0] * 0.9, rel=0.01)  # of what comes from behind, all that is scattered
    assert mean == pytest.approx(turned, abs=1e-3)
    assert deviation == pytest.approx(np.sqrt(spread), rel=0.03)


def test_unscattered_light_is_the_chance_of_no_strand():
    np.testing.assert_allclose(dual_scattering.direct_part(np.array([0.0, 2.0])), [1.0, np.exp(-2.0)])
