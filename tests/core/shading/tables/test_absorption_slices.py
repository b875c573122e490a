# SPDX-License-Identifier: GPL-3.0-or-later
"""Slices of absorption equal tables that are baked for one absorption."""

from dataclasses import replace

import numpy as np
import pytest

from hair_addon.core.shading.fibre.angles import FibreAngles
from hair_addon.core.shading.tables import absorption_slices, lookup_tables

SIZE = 64


@pytest.fixture(scope="module", params=["energy", "classic"])
def settings(request):
    return lookup_tables.Settings(mode=request.param, size=SIZE, caustic="exact")


def as_half(slices):
    return replace(slices, n=lookup_tables.to_half(slices.n).astype(float))


def random_angles(rng, count):
    theta_i, theta_o = rng.uniform(-1.4, 1.4, (2, count))
    return FibreAngles(theta_i, theta_o, rng.uniform(-np.pi, np.pi, count))


@pytest.mark.parametrize("sigma_a_range", [(0.0, 15.0), (0.05, 2.0)])
def test_any_absorption_between_slices_is_known_to_a_percent(rng, settings, sigma_a_range):
    slices = as_half(absorption_slices.bake(settings, sigma_a_range))
    sigma_a = np.square(rng.uniform(*np.sqrt(sigma_a_range), 40))
    exact = lookup_tables.azimuthal_lobes(settings, sigma_a)[1:3]
    u, v = rng.random((2, 3000))
    for index, absorption in enumerate(sigma_a):
        found = absorption_slices.sample(slices.n, slices.range, u, v, np.full(3000, absorption))
        for lobe, table in enumerate(exact):
            expected = lookup_tables.sample(table[..., index : index + 1], u, v)[..., 0]
            # Half floats below 6e-5 are kept as none.
            np.testing.assert_allclose(found[..., lobe], expected, rtol=0.01, atol=1e-4)


def test_channels_are_looked_up_each_for_itself(rng, settings):
    """Each channel is looked up in the tables of its own absorption; M of the classic mode is read from a texture."""
    sigma_a = (0.2, 0.5, 3.0)
    at = random_angles(rng, 2000)
    slices = absorption_slices.bake(settings, (0.1, 4.0))
    found = absorption_slices.sample_radiance(slices, at, np.broadcast_to(sigma_a, (2000, 3)))
    expected = lookup_tables.sample_radiance(lookup_tables.bake(replace(settings, sigma_a=sigma_a)), at)
    tolerance = 0.01 if settings.mode == "energy" else 0.05
    assert np.abs(found - expected).max() < tolerance * expected.max()
    assert np.abs(found - expected).mean() < 0.4 * tolerance * expected.mean()


def test_strands_of_different_absorption_stand_side_by_side(rng, settings):
    at, sigma_a = random_angles(rng, 300), rng.uniform(0.1, 4.0, (300, 3))
    slices = absorption_slices.bake(settings, (0.1, 4.0))
    together = absorption_slices.sample_radiance(slices, at, sigma_a)
    for index in (0, 150, 299):
        alone = absorption_slices.sample_radiance(
            slices, FibreAngles(*(angle[index : index + 1] for angle in at)), sigma_a[index : index + 1]
        )
        np.testing.assert_allclose(together[index], alone[0], rtol=1e-12)


def test_absorption_beyond_the_range_is_held_to_it(settings):
    slices = absorption_slices.bake(settings, (0.5, 2.0), slice_count=4)
    u, v = np.full((2, 2), 0.9)
    found = absorption_slices.sample(slices.n, slices.range, u, v, np.array([0.0, 99.0]))
    expected = absorption_slices.sample(slices.n, slices.range, u, v, np.array([0.5, 2.0]))
    np.testing.assert_allclose(found, expected, rtol=1e-6)


def test_hair_without_variation_takes_a_range_of_one_value(settings):
    slices = absorption_slices.bake(settings, (0.7, 0.7))
    u, v = np.full((2, 1), 0.9)
    exact = lookup_tables.azimuthal_lobes(settings, (0.7,))[1]
    found = absorption_slices.sample(slices.n, slices.range, u, v, np.array([0.7]))[0, 0]
    assert found == pytest.approx(float(lookup_tables.sample(exact, u, v)[0, 0]), rel=1e-5)
