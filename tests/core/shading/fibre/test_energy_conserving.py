# SPDX-License-Identifier: GPL-3.0-or-later
"""The energy-conserving mode passes the white furnace, and has its smooth limit, near field and tables."""

from dataclasses import replace

import numpy as np
import pytest

from hair_addon.core.errors import HairError
from hair_addon.core.shading.fibre import energy_conserving
from hair_addon.core.shading.fibre.angles import FibreAngles
from hair_addon.core.shading.tables import albedo, lookup_tables
from tests.support.pairs import pairs

WHITE = (0.0, 0.0, 0.0)
SIGMA_A = (0.1, 0.4, 1.5)
TABLES = ("m", "n", "n_trt", "n_res")


def energy_settings(**details):
    return lookup_tables.Settings(**({"mode": "energy", "sigma_a": SIGMA_A} | details))


def halves(settings):
    """Return baked tables rounded to half floats."""
    tables = lookup_tables.bake(settings)
    return replace(tables, **{name: lookup_tables.to_half(getattr(tables, name)).astype(float) for name in TABLES})


@pytest.fixture(scope="module", params=[{"tilt": 0.0}, {"tilt": 0.035}, {"tilt": -0.15, "axes": "COSINES"}], ids=str)
def white(request):
    return halves(energy_settings(sigma_a=WHITE, **request.param))


@pytest.mark.parametrize("degrees", [0, 30, -45, 60, 70, -75, 80, 85])
def test_a_white_fibre_vanishes_in_a_white_surrounding(white, degrees):
    nodes, weights = np.polynomial.legendre.leggauss(160)
    theta_i = 0.5 * np.pi * nodes
    phi = (np.arange(256) + 0.5) / 256 * np.pi
    at = FibreAngles(theta_i[:, None], np.full((160, 1), np.radians(degrees)), phi[None, :])
    radiance = lookup_tables.sample_radiance(white, FibreAngles(*np.broadcast_arrays(*at)))[..., 0].mean(axis=1)
    returned = 2.0 * np.pi * np.sum(radiance * np.cos(theta_i) * weights * 0.5 * np.pi)
    assert returned == pytest.approx(1.0, abs=5e-3)


@pytest.mark.parametrize("details", [{"roughness": 1.0, "radial_roughness": 1.0}, {"coat": 1.0, "radial_roughness": 0}])
def test_rough_and_coated_white_fibres_lose_nothing_either(details):
    tables = halves(energy_settings(sigma_a=WHITE, **details))
    rows = tables.n[..., :3].mean(axis=1) + tables.n[..., 3:].mean(axis=1) + tables.n_trt.mean(axis=1)
    np.testing.assert_allclose(2.0 * np.pi * (rows + tables.n_res[:, 0]), 1.0, atol=1e-3)
    np.testing.assert_allclose(albedo.mean_albedo(tables), 1.0, atol=1e-3)


def test_m_table_holds_the_lobes():
    settings = energy_settings(coat=0.3, tilt=0.1)
    theta = ((np.arange(256) + 0.5) / 256 - 0.5) * np.pi
    expected = energy_conserving.m_lobes(theta[None, :], theta[:, None], settings)
    np.testing.assert_allclose(lookup_tables.bake(settings).m, expected, rtol=1e-6, atol=1e-30)


def test_with_falling_roughness_light_leaves_as_from_a_smooth_fibre():
    """With falling roughness light leaves as from a smooth fiber: the integral of the difference over all texels
    vanishes.
    """
    smooth = lookup_tables.bake(lookup_tables.Settings(sigma_a=SIGMA_A, caustic="exact"))
    misplaced = []
    for radial_roughness in (0.2, 0.1, 0.05, 0.0):
        rough = lookup_tables.bake(energy_settings(radial_roughness=radial_roughness))
        misplaced.append([np.abs(rough.n - smooth.n).mean() / smooth.n.mean()])
        misplaced[-1].append(np.abs(rough.n_trt - smooth.n_trt).mean() / smooth.n_trt.mean())
    assert (np.diff(misplaced, axis=0) < 0.0).all()
    assert max(misplaced[-1]) < 0.05


WIDE_TOLERANCES = {0.15: 0.03, 0.3: 5e-3, 0.7: 1e-3, 1.0: 1e-3}  # by radial roughness


@pytest.mark.parametrize(("row", "radial_roughness"), pairs([3, 90, 173, 255], WIDE_TOLERANCES))
def test_texels_are_the_rays_of_the_whole_width(radial_roughness, row):
    """Texels are the rays of the whole width: the matrix over exact cells equals quadrature over the fiber's width."""
    settings = energy_settings(radial_roughness=radial_roughness)
    tables = lookup_tables.bake(settings)
    phi = (np.arange(256) + 0.5) / 256 * np.pi
    expected = energy_conserving.n_lobes(phi, np.array((row + 0.5) / 256), settings)
    n_r, n_res = np.repeat(tables.n[row, :, 3:], 3, axis=1), np.repeat(tables.n_res[row], 256, axis=0)
    found = np.stack([n_r, tables.n[row, :, :3], tables.n_trt[row], n_res], axis=1)
    assert np.abs(found - expected).max() < 3e-3 * expected.max()
    np.testing.assert_allclose(
        found, expected, rtol=WIDE_TOLERANCES[radial_roughness], atol=WIDE_TOLERANCES[radial_roughness] * 1e-3
    )


def test_one_wide_strand_is_the_mean_of_its_near_field(rng):
    settings = energy_settings(radial_roughness=0.4)
    phi, cos_theta_o = rng.uniform(-np.pi, np.pi, 5), rng.uniform(0.1, 1.0, 5)
    h = (np.arange(20_000) + 0.5) / 10_000 - 1.0
    near = energy_conserving.near_field_lobes(h, phi[:, None], cos_theta_o[:, None], settings).mean(axis=1)
    np.testing.assert_allclose(energy_conserving.n_lobes(phi, cos_theta_o, settings), near, rtol=1e-3, atol=1e-6)


def test_tables_stand_for_the_model(rng):
    settings = energy_settings(tilt=0.05)
    theta_i, theta_o = rng.uniform(-1.4, 1.4, (2, 500))
    at = FibreAngles(theta_i, theta_o, rng.uniform(-np.pi, np.pi, 500))
    found = lookup_tables.sample_radiance(halves(settings), at)
    expected = energy_conserving.scattering(at, settings)
    np.testing.assert_allclose(found, expected, rtol=0.01, atol=1e-3 * expected.max())


def test_the_first_highlight_turns_to_the_root_and_a_coat_sharpens_it_alone():
    theta_i = np.linspace(-0.5, 0.5, 4001)
    plain, coated = (
        energy_conserving.m_lobes(theta_i, 0.0, energy_settings(tilt=0.05, roughness=0.1, coat=coat))
        for coat in (0.0, 0.5)
    )
    peaks = theta_i[np.argmax(plain[:, :3], axis=0)]
    np.testing.assert_allclose(peaks, [-0.1, 0.05, 0.2], atol=5e-3)
    np.testing.assert_array_equal(coated[:, 1:], plain[:, 1:])
    assert coated[:, 0].max() > 1.5 * plain[:, 0].max()


def test_transmitted_light_is_half_as_wide_and_inner_reflections_twice():
    """Transmitted light is half as wide and inner reflections twice, by the deviation of theta_i + theta_o, as for
    Marschner.
    """
    settings = energy_settings(roughness=0.15, tilt=0.05)
    theta_i = np.linspace(-1.5, 1.5, 6001)
    weights = energy_conserving.m_lobes(theta_i, 0.0, settings) * np.cos(theta_i)[:, None]
    centres = np.array([-0.1, 0.05, 0.2, 0.0])
    deviations = np.sqrt([np.average((theta_i - c) ** 2, weights=w) for c, w in zip(centres, weights.T, strict=True)])
    np.testing.assert_allclose(deviations / deviations[0], [1.0, 0.5, 2.0, 2.0], rtol=0.04)


def test_more_absorption_never_brightens():
    pale, dark = (lookup_tables.bake(energy_settings(sigma_a=sigma_a)) for sigma_a in (SIGMA_A, (0.2, 0.8, 3.0)))
    for name in ("n", "n_trt", "n_res"):
        assert (getattr(dark, name) <= getattr(pale, name) * (1.0 + 1e-6)).all()


@pytest.mark.parametrize(
    "wrong",
    [
        {"roughness": -0.1},
        {"roughness": 1.1},
        {"radial_roughness": np.nan},
        {"radial_roughness": 2.0},
        {"coat": -1.0},
        {"coat": np.inf},
        {"mode": "both"},
    ],
)
def test_impossible_settings_are_refused(wrong):
    with pytest.raises(HairError):
        energy_settings(**wrong)
