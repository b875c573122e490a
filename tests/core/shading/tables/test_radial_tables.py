# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables of strands that differ in radial roughness."""

from dataclasses import replace

import numpy as np
import pytest

from hair_addon.core.shading.fibre import strand_variation
from hair_addon.core.shading.tables import albedo, look_tables, lookup_tables, radial_tables

SETTINGS = lookup_tables.Settings(mode="energy", size=64)
VARIATION = strand_variation.Settings()
COVERED = look_tables.covering(0.1, 1.0)


@pytest.fixture(scope="module")
def tables():
    return radial_tables.bake(SETTINGS, VARIATION, COVERED, radial_tables.covering(0.4, 0.55))


def at(radial):
    return look_tables.bake(replace(SETTINGS, radial_roughness=radial), VARIATION, COVERED)


@pytest.mark.parametrize(("least", "greatest"), [(0.0, 0.0), (0.3, 0.3), (0.26, 0.31), (0.0, 1.0), (1.0, 1.0)])
def test_layers_cover_the_range(least, greatest):
    """Each radial roughness of the range is between two layers, which are at fixed places."""
    layers = radial_tables.covering(least, greatest)
    below, fraction = radial_tables.layer_of(layers, np.array([least, greatest]))
    np.testing.assert_allclose(layers.low + layers.step * (below + fraction), [least, greatest], atol=1e-12)
    assert 0.0 <= layers.low and layers.low + layers.step * (layers.count - 1) <= 1.0
    assert layers.low / layers.step == round(layers.low / layers.step)


def test_between_layers_light_is_nearly_the_light_of_the_radial_roughness(tables):
    """Between layers N is within 1 % of its peak, and the light that strands pass on within a thousandth."""
    radial = 0.46875  # the middle of two layers
    below, fraction = radial_tables.layer_of(tables.layers, radial)
    exact = at(radial)
    for name in ("n", "n_g"):
        ends = [getattr(each.slices, name) for each in tables.tables[below : below + 2]]
        found = (1.0 - fraction) * ends[0] + fraction * ends[1]
        wanted = getattr(exact.slices, name)
        np.testing.assert_allclose(found, wanted, atol=0.01 * wanted.max())
    some = np.random.default_rng(0).uniform(0.1, 1.0, (20, 4, 3))
    found = tables.mean_parts(some, np.full(20, radial))
    np.testing.assert_allclose(found, exact.mean_parts(some), atol=1e-3)


def test_light_passed_on_is_the_mean_over_strands(tables):
    """Strands with two values of radial roughness pass on the mean of their light."""
    some = np.random.default_rng(0).uniform(0.1, 1.0, (20, 4, 3))
    radial = np.where(np.arange(20) < 5, 0.4375, 0.5)
    parts = [np.stack(at(value).mean_parts(some[radial == value])) for value in (0.4375, 0.5)]
    np.testing.assert_allclose(tables.mean_parts(some, radial), 0.25 * parts[0] + 0.75 * parts[1], rtol=1e-9)


@pytest.mark.parametrize("root", [0.03, 0.0625, 0.3, 0.69])
def test_strands_in_even_light_have_the_light_of_their_own_tables(root):
    """In even light a strand between two slices is within 0.6/255 of tables that are baked for its absorption."""
    baked = look_tables.bake(SETTINGS, VARIATION, look_tables.covering(0.0, 1.0))
    exact = albedo.azimuthal_moments(lookup_tables.bake(replace(SETTINGS, sigma_a=(root**2,) * 3)))[0, :, 0]
    rows = baked.returned[..., 0]
    place = root / baked.slices.range.high * (len(rows) - 1)
    below = int(place)
    found = rows[below] + (place - below) * (rows[below + 1] - rows[below])
    np.testing.assert_allclose(found, exact, atol=0.6 / 255.0)
