# SPDX-License-Identifier: GPL-3.0-or-later
"""The baked tables equal an independent ray tracer of a smooth cylinder."""

import numpy as np
import pytest

from hair_addon.core.shading.fibre import marschner, paths
from hair_addon.core.shading.fibre.fresnel import bravais_indices
from hair_addon.core.shading.fibre.pigment import sigma_a_from_melanin
from hair_addon.core.shading.tables import lookup_tables
from tests.support.pairs import share_of
from tests.support.pictures import cylinder_tracer

ETA = 1.55
SIZE = 256
MELANIN = {"blond": 0.220, "brown": 0.659, "black": 0.9987}
THETA_D = {degrees: np.radians(degrees) for degrees in (0, 20, 40, 47, 60, 75)}  # eta' = 2 at 46.9


@pytest.fixture(scope="module", params=MELANIN)
def hair(request):
    """Return (sigma_a, tables without caustic treatment) of one hair color."""
    sigma_a = tuple(map(float, sigma_a_from_melanin(MELANIN[request.param], 0.0)))
    tables = lookup_tables.bake(lookup_tables.Settings(eta=ETA, sigma_a=sigma_a, caustic="exact", size=SIZE))
    return sigma_a, tables


def row_of(theta_d):
    """Return (row, theta_d of its middle) next to an angle."""
    row = min(int(np.cos(theta_d) * SIZE), SIZE - 1)
    return row, np.arccos((row + 0.5) / SIZE)


def lobes(n, n_trt):
    """Return (3, W, C) of N_R, N_TT, N_TRT from rows of the tables (W, 4) and (W, 3)."""
    return np.stack([np.repeat(n[:, 3:], 3, axis=1), n[:, :3], n_trt])


def assert_close(found, expected, where):
    """Assert agreement within 1 % or 3e-4."""
    excess = np.abs(found - expected) - np.maximum(0.01 * np.abs(expected), 3e-4)
    assert np.all(excess[:, where] < 0.0)


@pytest.mark.parametrize("degrees", share_of(THETA_D, 4))
def test_texels_are_the_light_that_leaves_through_them(hair, degrees):
    """Texels are the light that leaves through them, also the caustic's in the middle of a row, as both are means."""
    sigma_a, tables = hair
    row, theta_d = row_of(THETA_D[degrees])
    traced = cylinder_tracer.trace(theta_d, ETA, sigma_a, ray_count=200_000)
    expected = cylinder_tracer.cell_means(traced, SIZE)
    assert_close(lobes(tables.n[row], tables.n_trt[row]), expected, slice(None))


@pytest.mark.parametrize("degrees", THETA_D)
def test_rows_hold_all_the_energy(hair, degrees):
    """A row holds all the energy: its sum is ½ int A dh."""
    sigma_a, tables = hair
    row, theta_d = row_of(THETA_D[degrees])
    expected = cylinder_tracer.energies(cylinder_tracer.trace(theta_d, ETA, sigma_a, ray_count=20_000))
    found = 2.0 * np.pi / SIZE * lobes(tables.n[row], tables.n_trt[row]).sum(axis=1, dtype=float)
    np.testing.assert_allclose(found, expected, rtol=5e-4, atol=1e-7)


@pytest.mark.parametrize("degrees", share_of([10, 33, 55, 70]))
def test_half_float_lookups_between_rows(hair, degrees):
    """Bilinear lookups of half floats between rows agree, away from the caustic."""
    sigma_a, tables = hair
    theta_d = np.radians(degrees)
    expected = cylinder_tracer.cell_means(cylinder_tracer.trace(theta_d, ETA, sigma_a, ray_count=200_000), SIZE)
    phi = (np.arange(SIZE) + 0.5) / SIZE * np.pi
    at = lookup_tables.n_coordinates(phi, np.cos(theta_d), "ANGLES")
    n, n_trt = (
        lookup_tables.sample(lookup_tables.to_half(table).astype(float), *np.broadcast_arrays(*at))
        for table in (tables.n, tables.n_trt)
    )
    eta_prime, _ = bravais_indices(np.cos(theta_d), ETA)
    rim = np.array([2.0 * np.arcsin(1.0 / eta_prime), abs(np.pi - 4.0 * np.arcsin(1.0 / eta_prime))])
    breaks = np.append(rim, paths.exit_angle(paths.TRT, paths.caustic_gamma(eta_prime), eta_prime))
    away = np.all(np.abs(phi[:, None] - np.abs(breaks)) > 3.0 * np.pi / SIZE, axis=1)
    assert away.sum() > 0.9 * SIZE
    assert_close(lobes(n, n_trt), expected, away)


@pytest.mark.parametrize("degrees", THETA_D)
def test_roots_agree_with_ray_tracing(degrees):
    """Roots agree with ray tracing, averaged over cells by brute force, away from the caustic and the edges of
    support.
    """
    theta_d, sigma_a = THETA_D[degrees], (0.1, 0.5, 2.0)
    cell_count, samples = 64, 200
    expected = cylinder_tracer.cell_means(cylinder_tracer.trace(theta_d, ETA, sigma_a, 200_000), cell_count)
    phi = (np.arange(cell_count * samples) + 0.5) / (cell_count * samples) * np.pi
    cos_theta_d = np.cos(theta_d)
    values = np.stack(
        [
            np.repeat(marschner.n_r(phi, cos_theta_d, ETA)[:, None], 3, axis=1),
            marschner.n_tt(phi, cos_theta_d, ETA, sigma_a),
            marschner.n_trt(phi, cos_theta_d, ETA, sigma_a),
        ]
    )
    found = values.reshape(3, cell_count, samples, 3).mean(axis=2)
    error = np.abs(found - expected) / np.maximum(expected, 1e-3)
    # A caustic's own cell is not to be had from points: at most four cells hold a caustic or an edge.
    assert np.all(np.sort(error.max(axis=(0, 2)))[:-4] < 2e-3)
