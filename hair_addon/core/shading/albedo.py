# SPDX-License-Identifier: GPL-3.0-or-later
"""What a fibre returns of light from everywhere: one number a channel, for the world's even light."""

import numpy as np

from .lookup_tables import phi_edges
from .marschner import LEAST_COS_THETA_D, longitudinal_lobes, m_lobe

_INCLINATIONS = 181


def mean_albedo(tables):
    """Radiance of a fibre in a uniform surrounding of radiance one, RGB (3,), the mean over all directions of view.

    For one theta_o it is the integral of S cos²(theta_i) over theta_i and phi, the adjoint of the energy measure of
    [Marschner03].
    """
    theta = np.pi * ((np.arange(_INCLINATIONS) + 0.5) / _INCLINATIONS - 0.5)
    cell_widths = np.abs(np.diff(phi_edges(tables.settings)))
    # Both halves of the circle: N is even in phi.
    n_tt = 2.0 * np.einsum("hwc,w->hc", tables.n[..., :3], cell_widths)
    n_r = 2.0 * np.einsum("hw,w->h", tables.n[..., 3], cell_widths)[:, None]
    n_trt = 2.0 * np.einsum("hwc,w->hc", tables.n_trt, cell_widths)

    cosine = np.maximum(np.cos(0.5 * (theta[:, None] - theta[None, :])), LEAST_COS_THETA_D)
    rows = (np.arange(tables.settings.size) + 0.5) / tables.settings.size
    scattered = 0.0
    for m, n in zip(_longitudinal(tables, theta), (n_r, n_tt, n_trt), strict=True):
        for_theta_d = np.stack([np.interp(cosine, rows, n[:, c]) for c in range(n.shape[1])], axis=-1)
        scattered = scattered + m[..., None] * for_theta_d
    scattered = scattered * (np.cos(theta)[None, :] / cosine)[..., None] ** 2
    albedo = scattered.sum(axis=1) * (np.pi / _INCLINATIONS)  # over theta_i
    solid_angle = np.cos(theta)
    return np.average(albedo, axis=0, weights=solid_angle) * np.ones(3)


def _longitudinal(tables, theta):
    """M of R, TT and TRT, each (theta_o, theta_i), exactly as `lookup_tables` bakes them."""
    theta_h = 0.5 * (theta[:, None] + theta[None, :])
    return [m_lobe(theta_h, alpha, beta) for alpha, beta in longitudinal_lobes(tables.settings)]
