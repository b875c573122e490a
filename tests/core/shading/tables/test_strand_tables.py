# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables of varied strands equal tables baked for one absorption."""

from dataclasses import replace

import numpy as np
import pytest

from hair_addon.core.shading import appearance
from hair_addon.core.shading.appearance import Appearance
from hair_addon.core.shading.fibre import strand_variation
from hair_addon.core.shading.fibre.angles import FibreAngles
from hair_addon.core.shading.tables import albedo, dual_scattering, lookup_tables, strand_tables
from tests.support.devices import DEVICE

DYED = Appearance(melanin=0.22, redness=0.3, tip_absorption=0.4, tip_tint=(0.8, 0.12, 0.35), gradient_start=0.0)
COUNT = 1500


def bake(look, size=64):
    settings = appearance.table_settings(look, lookup_tables.Settings(size=size))
    return strand_tables.bake(settings, appearance.strand_settings(look))


def exact(tables, sigma_a):
    """Return `lookup_tables.Tables` of one absorption and the same fiber."""
    return lookup_tables.bake(replace(tables.settings, sigma_a=tuple(map(float, sigma_a))))


def random_angles(rng):
    theta_i, theta_o = rng.uniform(-1.4, 1.4, (2, COUNT))
    return FibreAngles(theta_i, theta_o, rng.uniform(-np.pi, np.pi, COUNT))


@pytest.mark.parametrize("position", [0.0, 0.3, 0.5, 1.0])
def test_dyed_hair_scatters_as_hair_of_that_colour(rng, position):
    """Dyed hair, whose strands all have one absorption, scatters as by tables of that absorption."""
    tables = bake(DYED)
    sigma_a = strand_variation.strand_sigma_a(tables.variation, 0.5, position)
    of_one = exact(tables, sigma_a)
    dual = dual_scattering.bake(of_one)
    at, (front, behind) = random_angles(rng), rng.uniform(0.0, 6.0, (2, COUNT))
    found = strand_tables.sample_radiance(tables, at, np.full(COUNT, 0.5), np.full(COUNT, position), front, behind)
    expected = dual_scattering.sample_radiance(of_one, dual, at, front, behind)
    np.testing.assert_allclose(found, expected, rtol=0.01, atol=1e-4)
    theta = dual_scattering.light_inclinations()
    returned = strand_tables.hair_return(tables, theta, np.full(len(theta), 0.5), np.full(len(theta), position))
    # The second is a small difference of large parts.
    np.testing.assert_allclose(returned, albedo.azimuthal_moments(of_one), rtol=5e-3, atol=2e-3)


def test_smaller_slices_than_tables_leave_three_parts_in_a_thousand(rng):
    tables = bake(DYED, size=256)
    assert tables.settings.size == strand_tables.GREATEST_SIZE < 256
    of_one = lookup_tables.bake(replace(tables.settings, size=256, sigma_a=appearance.sigma_a(DYED)))
    at, still = random_angles(rng), np.zeros(COUNT)
    found = strand_tables.sample_radiance(tables, at, still, still, still, still)
    expected = lookup_tables.sample_radiance(of_one, at)
    assert np.abs(found - expected).max() < 3e-3 * expected.max()


def test_strands_around_are_of_all_random_numbers():
    tables = bake(Appearance(melanin=0.3, redness=0.0, random_color=1.0))
    numbers = (np.arange(24) + 0.5) / 24
    theta = dual_scattering.light_inclinations()
    forward = [
        dual_scattering.scattered_parts(
            exact(tables, strand_variation.strand_sigma_a(tables.variation, number, 0.0)), theta
        )[0].sum(axis=0)
        for number in numbers
    ]
    (a_f, *_), *others = tables.dual
    assert not others  # roots and tips are alike
    np.testing.assert_allclose(a_f, np.mean(forward, axis=0), rtol=5e-3)
    np.testing.assert_allclose(
        tables.forward, np.average(np.mean(forward, axis=0), axis=0, weights=np.cos(theta)), rtol=5e-3
    )


@pytest.mark.parametrize("mode", ["energy", "classic"])
def test_what_goes_on_is_the_mean_along_the_strands(mode):
    tables = bake(replace(DYED, mode=mode))
    positions = (np.arange(32) + 0.5) / 32
    along = [
        albedo.mean_forward(exact(tables, strand_variation.strand_sigma_a(tables.variation, 0.5, position)))
        for position in positions
    ]
    np.testing.assert_allclose(tables.forward, np.mean(along, axis=0), rtol=2e-3)


def test_white_hair_returns_all_light_whatever_its_roughness():
    look = Appearance(parametrization="ABSORPTION", absorption=(0.0, 0.0, 0.0), random_roughness=1.0)
    tables = bake(look)
    assert not tables.variation.is_even
    np.testing.assert_allclose(tables.returned[..., 0], 1.0, atol=3e-3)


def test_strands_that_let_no_blue_through_keep_their_red(rng):
    """The slices do not stretch to an absorption a thousand times that of red."""
    look = Appearance(parametrization="ABSORPTION", absorption=(0.3, 1.0, 900.0), random_color=1.0, tip_absorption=10.0)
    tables = bake(look)
    at, still = random_angles(rng), np.zeros(COUNT)
    found = strand_tables.sample_radiance(tables, at, still + 0.5, still, still, still)
    of_one = exact(tables, strand_variation.strand_sigma_a(tables.variation, 0.5, 0.0))
    expected = lookup_tables.sample_radiance(of_one, at)
    np.testing.assert_allclose(found, expected, rtol=0.02, atol=2e-4)


def test_even_hair_needs_no_slices():
    assert appearance.strand_settings(Appearance()).is_even
    for changes in ({"random_color": 0.1}, {"random_roughness": 0.1}, {"tip_absorption": 2.0}, {"tip_tint": (0, 1, 1)}):
        assert not appearance.strand_settings(replace(Appearance(), **changes)).is_even


@pytest.mark.skipif(DEVICE == "cpu", reason="compares another device with the processor")
@pytest.mark.parametrize("mode", ["energy", "classic"])
def test_devices_bake_the_same_tables(mode, device):
    look = replace(DYED, mode=mode, random_color=0.5)
    settings, variation = appearance.table_settings(look), appearance.strand_settings(look)
    expected, found = (strand_tables.bake(settings, variation, where) for where in ("cpu", device))
    np.testing.assert_allclose(found.slices.n, expected.slices.n, rtol=1e-4, atol=1e-5)
    np.testing.assert_allclose(found.returned, expected.returned, rtol=1e-4, atol=1e-5)
    np.testing.assert_allclose(found.forward, expected.forward, rtol=1e-4)
    np.testing.assert_allclose(found.backward, expected.backward, rtol=1e-4)
