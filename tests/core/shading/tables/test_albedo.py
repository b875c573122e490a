# SPDX-License-Identifier: GPL-3.0-or-later
"""The response of a fiber to surrounding light equals the integral over all directions."""

import numpy as np
import pytest

from hair_addon.core.shading.fibre.angles import FibreAngles
from hair_addon.core.shading.tables import albedo, dual_scattering, lookup_tables

BROWN = (0.1, 0.25, 0.6)


@pytest.mark.parametrize("mode", ["energy", "classic"])
def test_moments_are_those_of_the_radiance_over_all_directions(mode):
    """The moments agree for uniform light weighted by cos(phi), and for light as P1 and P2 of sin(theta_i)."""
    tables = lookup_tables.bake(lookup_tables.Settings(mode=mode, sigma_a=BROWN, caustic="exact"))
    moments = albedo.azimuthal_moments(tables)
    nodes, weights = np.polynomial.legendre.leggauss(300)
    theta_i = 0.5 * np.pi * nodes
    phi = (np.arange(256) + 0.5) / 256 * np.pi
    columns = dual_scattering.light_inclinations()
    for column in (20, 64, 100):
        at = FibreAngles(*np.broadcast_arrays(theta_i[:, None], columns[column], phi))
        measure = (
            np.pi**2 / 256 * (weights * np.cos(theta_i))[:, None, None] * lookup_tables.sample_radiance(tables, at)
        )
        sine = np.sin(theta_i)[:, None, None]
        factors = 1.0, np.cos(phi)[:, None], sine, 1.5 * sine**2 - 0.5
        expected = [(measure * factor).sum(axis=(0, 1)) for factor in factors]
        np.testing.assert_allclose(moments[:, column], expected, rtol=0.01, atol=0.01 * np.max(expected[0]))
