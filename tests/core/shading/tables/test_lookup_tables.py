# SPDX-License-Identifier: GPL-3.0-or-later
"""The tables agree with their model in axes, means over cells, lookups and half floats."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hair_addon.core.errors import HairError
from hair_addon.core.shading.fibre import marschner
from hair_addon.core.shading.fibre.angles import FibreAngles
from hair_addon.core.shading.tables import lookup_tables
from tests.support.pairs import share_of

SIGMA_A = (0.1, 0.4, 1.5)


def baked(**details):
    return lookup_tables.bake(lookup_tables.Settings(**({"sigma_a": SIGMA_A} | details)))


@pytest.fixture(scope="module", params=["ANGLES", "COSINES"])
def tables(request):
    return baked(axes=request.param)


def centres(count):
    return (np.arange(count) + 0.5) / count


def test_every_texel_of_m_is_the_model_at_its_middle(tables):
    u = centres(256)
    theta = np.arcsin(2.0 * u - 1.0) if tables.settings.axes == "COSINES" else (u - 0.5) * np.pi
    theta_i, theta_o = np.meshgrid(theta, theta)  # columns, rows
    for channel, (alpha, beta) in enumerate(marschner.longitudinal_lobes(tables.settings)):
        expected = marschner.m_lobe(0.5 * (theta_i + theta_o), alpha, beta)
        np.testing.assert_allclose(tables.m[..., channel], expected, rtol=1e-6, atol=1e-30)
    np.testing.assert_allclose(tables.m[..., 3], np.cos(0.5 * (theta_o - theta_i)), atol=1e-6)


def cell_means(evaluate, tables, row, samples=400):
    """Return means over the cells of one row by brute force, (W, C)."""
    edges = lookup_tables.phi_edges(tables.settings)
    phi = edges[:-1, None] + np.diff(edges)[:, None] * centres(samples)
    return evaluate(phi, (row + 0.5) / tables.settings.size).mean(axis=1)


@pytest.mark.parametrize("row", share_of([3, 90, 173, 179, 255], 2))
def test_texels_are_means_of_the_model_over_their_cells(tables, row):
    r = cell_means(lambda phi, c: marschner.n_r(phi, c, 1.55), tables, row)
    np.testing.assert_allclose(tables.n[row, :, 3], r, rtol=1e-5, atol=1e-7)
    tt = cell_means(lambda phi, c: marschner.n_tt(phi, c, 1.55, SIGMA_A), tables, row)
    np.testing.assert_allclose(tables.n[row, :, :3], tt, rtol=1e-3, atol=3e-4)  # brute force cuts at the support's edge
    trt = cell_means(lambda phi, c: marschner.n_trt_caustic(phi, c, tables.settings), tables, row)
    np.testing.assert_allclose(tables.n_trt[row], trt, rtol=1e-3, atol=3e-5)


def test_both_pairs_of_axes_hold_the_same_energy():
    energies = []
    for axes in ("ANGLES", "COSINES"):
        tables = baked(axes=axes, size=64, caustic="exact")
        widths = np.abs(np.diff(lookup_tables.phi_edges(tables.settings)))
        both = np.concatenate([tables.n, tables.n_trt], axis=-1, dtype=float)
        energies.append(np.einsum("hwc,w->hc", both, widths))
    np.testing.assert_allclose(*energies, rtol=1e-5)


@pytest.mark.parametrize("size", [16, 33, 100])
def test_tables_of_any_size_hold_the_same_light(size):
    """Tables of any size hold the same light, as blocks of rows do not have to divide a table."""
    tables = baked(size=size)
    row = size // 2
    expected = cell_means(lambda phi, c: marschner.n_r(phi, c, 1.55), tables, row)
    np.testing.assert_allclose(tables.n[row, :, 3], expected, rtol=1e-5)
    assert tables.m.shape == tables.n.shape == (size, size, 4)
    assert tables.n_trt.shape == (size, size, 3)


def test_lookups_at_texel_middles_give_the_texels(tables):
    u, v = np.meshgrid(centres(256), centres(256))
    np.testing.assert_allclose(lookup_tables.sample(tables.n, u, v), tables.n, atol=1e-6)


@given(st.floats(-1.0, 2.0), st.floats(-1.0, 2.0))
def test_lookups_are_linear_inside_and_constant_beyond_the_edge(u, v):
    across, down = np.meshgrid(centres(32), centres(16))
    ramp = np.stack([across, down], axis=-1)
    expected = [np.clip(u, 0.5 / 32, 1 - 0.5 / 32), np.clip(v, 0.5 / 16, 1 - 0.5 / 16)]
    np.testing.assert_allclose(lookup_tables.sample(ramp, u, v), expected, atol=1e-12)


def test_tables_stand_for_the_model(rng, tables):
    """Up to 80 degrees tables differ from [Marschner03] by at most 3 % of its brightest value, 1 % on average."""
    theta_i, theta_o = rng.uniform(-1.4, 1.4, (2, 4000))
    angles = FibreAngles(theta_i, theta_o, rng.uniform(-np.pi, np.pi, 4000))
    found = lookup_tables.sample_scattering(tables, angles)
    expected = marschner.scattering(angles, tables.settings)
    error = np.abs(found - expected)
    assert error.max() < 0.03 * expected.max()
    assert error.mean() < 0.01 * expected.mean()


def test_light_along_the_fibre_gives_a_finite_value(tables):
    angles = FibreAngles(np.array([np.pi / 2, -np.pi / 2]), np.array([np.pi / 2, np.pi / 2]), np.zeros(2))
    assert np.isfinite(lookup_tables.sample_scattering(tables, angles)).all()


@settings(max_examples=40)
@given(
    eta=st.floats(1.01, 3.0),
    sigma_a=st.floats(0.0, 1000.0),
    width=st.floats(np.radians(1.0), np.radians(60.0)),
    fade=st.floats(0.01, 2.0),
    caustic=st.sampled_from(["published", "exact"]),
    axes=st.sampled_from(["ANGLES", "COSINES"]),
)
def test_every_allowed_fibre_gives_finite_light(eta, sigma_a, width, fade, caustic, axes):
    tables = baked(
        eta=eta, sigma_a=(sigma_a, 0.0, 1.0), glint_width=width, glint_fade=fade, caustic=caustic, axes=axes, size=16
    )
    for table in (tables.m, tables.n, tables.n_trt):
        half = lookup_tables.to_half(table)
        assert np.isfinite(half).all()
        assert (half >= 0.0).all()


@given(st.floats(allow_nan=False))
def test_half_floats_are_finite_and_not_subnormal(value):
    half = float(lookup_tables.to_half(np.array([value]))[0])
    assert np.isfinite(half)
    if 6.2e-5 < abs(value) < 65504.0:
        assert half == pytest.approx(value, rel=2.0**-11)
    assert half == 0.0 or abs(half) >= 2.0**-14


@pytest.mark.parametrize("wrong", [{"size": 0}, {"size": -4}, {"size": 10_000}, {"size": 100.5}, {"axes": "SINES"}])
def test_impossible_sizes_are_refused(wrong):
    with pytest.raises(HairError):
        lookup_tables.Settings(**wrong)
