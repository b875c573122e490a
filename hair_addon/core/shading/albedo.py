# SPDX-License-Identifier: GPL-3.0-or-later
"""What a fibre returns and passes on of light from everywhere: one number a channel."""

import numpy as np

from .lookup_tables import phi_edges, row_cosines
from .marschner import LEAST_COS_THETA_D, longitudinal_lobes, m_lobe

_INCLINATIONS = 181


def mean_albedo(tables):
    """Radiance of a fibre in a uniform surrounding of radiance one, RGB (3,), the mean over all directions of view.

    For one theta_o it is the integral of S cos²(theta_i) over theta_i and phi, the adjoint of the energy measure of
    [Marschner03].
    """
    return _mean(tables, np.ones(tables.settings.size))


def mean_forward(tables):
    """The part of `mean_albedo` that goes on into the half space behind the fibre, RGB (3,): a_f of [Zinke08].

    With the light's azimuth anywhere in its half circle, the share |phi| / pi of light scattered by phi goes forward.
    """
    edges = phi_edges(tables.settings)
    return _mean(tables, 0.5 * (edges[1:] + edges[:-1]) / np.pi)


def _mean(tables, azimuthal_weights):
    """Integral of the radiance weighted over phi (W,), the mean over view directions, RGB (3,)."""
    # Twice: N is even in phi.
    weights = 2.0 * azimuthal_weights * np.abs(np.diff(phi_edges(tables.settings)))
    n_r = np.einsum("hwc,w->hc", tables.n[..., 3:], weights)
    n_tt = np.einsum("hwc,w->hc", tables.n[..., :3], weights)
    n_trt = np.einsum("hwc,w->hc", tables.n_trt, weights)
    if tables.settings.mode == "energy":
        # M is of unit area over the lights, whatever its width: only N's rows are left, over theta_o.
        rows = n_r + n_tt + n_trt + tables.n_res[:, 0] * weights.sum()
        cosine = row_cosines(tables.settings)
        # d(theta_o) = d(cos) / sin, with the density of directions cos(theta_o).
        return np.average(rows, axis=0, weights=cosine / np.sqrt(1.0 - cosine**2))
    return _classic_mean(tables.settings, n_r, n_tt, n_trt)


def _classic_mean(settings, n_r, n_tt, n_trt):
    """The same of rows over cos(theta_d), (H, 1 or 3), with the lobes of the classic mode."""
    theta = np.pi * ((np.arange(_INCLINATIONS) + 0.5) / _INCLINATIONS - 0.5)
    theta_h = 0.5 * (theta[:, None] + theta[None, :])  # theta_o in rows, theta_i in columns
    cosine = np.maximum(np.cos(0.5 * (theta[:, None] - theta[None, :])), LEAST_COS_THETA_D)
    rows = row_cosines(settings)
    scattered = np.zeros((*cosine.shape, 3))
    for (alpha, beta), n in zip(longitudinal_lobes(settings), (n_r, n_tt, n_trt), strict=True):
        for_theta_d = np.stack([np.interp(cosine, rows, column) for column in n.T], axis=-1)
        scattered += m_lobe(theta_h, alpha, beta)[..., None] * for_theta_d
    scattered *= (np.cos(theta)[None, :] / cosine)[..., None] ** 2
    over_theta_i = scattered.sum(axis=1) * (np.pi / _INCLINATIONS)
    return np.average(over_theta_i, axis=0, weights=np.cos(theta))
