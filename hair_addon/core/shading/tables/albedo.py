# SPDX-License-Identifier: GPL-3.0-or-later
"""Reflection and transmission of a fiber under uniform light."""

import numpy as np

from . import dual_scattering, lookup_tables

_INCLINATIONS = 181


def mean_albedo(tables: lookup_tables.Tables) -> np.ndarray:
    """Return the radiance of a fiber in uniform light of radiance one, RGB (3,), the mean over viewing directions."""
    forward, backward = mean_parts(tables.lobes, tables.settings)
    return forward + backward


def mean_forward(tables: lookup_tables.Tables) -> np.ndarray:
    """Return the part of `mean_albedo` scattered to the half space behind the fiber, RGB (3,): a_f of [Zinke08]."""
    return mean_parts(tables.lobes, tables.settings)[0]


def mean_parts(lobes: lookup_tables.Lobes, settings: lookup_tables.Settings) -> list[np.ndarray]:
    """Return forward and backward scattering, (C,) each, means over all directions; lobes: from `azimuthal_lobes`."""
    theta = dual_scattering.light_inclinations(_INCLINATIONS)
    parts = dual_scattering.lobe_parts(lobes, settings, theta)
    return [np.average(part.sum(axis=0), axis=0, weights=np.cos(theta)) for part in parts]


def azimuthal_moments(tables: lookup_tables.Tables) -> np.ndarray:
    """Return (4, K, 3) float32: the radiance toward theta_o in uniform light, and its moments.

    The second row is the same integral with the weight cos(phi), phi the azimuth between light and viewer: positive for
    back scattering. The third and fourth rows are the radiance in light that varies as the Legendre polynomials P1 and
    P2 of sin(theta_i). Columns are those of `DualTables.theta`.
    """
    return fibre_moments(tables.lobes, tables.settings).astype(np.float32)


def fibre_moments(lobes: lookup_tables.Lobes, settings: lookup_tables.Settings) -> np.ndarray:
    """Return `azimuthal_moments` (4, K, C) of one fiber; lobes: from `azimuthal_lobes`."""
    theta = dual_scattering.light_inclinations()
    rows = [dual_scattering.row_weights(settings, theta, degree) for degree in range(3)]
    edges = lookup_tables.phi_edges(settings)
    # The cells' integrals of 1 and of cos(phi), twice: N is even in phi.
    weights = [2.0 * np.diff(values) * np.sign(edges[-1] - edges[0]) for values in (edges, np.sin(edges))]
    wanted = (0, 0), (1, 0), (0, 1), (0, 2)  # indices of `weights` and of `rows`
    return np.stack(
        [dual_scattering.lobe_albedos(lobes, weights[over], rows[degree]).sum(axis=0) for over, degree in wanted]
    )
