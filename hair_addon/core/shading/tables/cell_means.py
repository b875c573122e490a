# SPDX-License-Identifier: GPL-3.0-or-later
"""Means of a smooth fiber's N_p over cells of phi: the texels of its tables.

The caustic of N_TRT is infinite, but its means are finite. The light A dh of each ray is added to the cell through
which the ray leaves.
"""

from collections.abc import Sequence

import numpy as np

from ...long_work import Progress, no_progress
from ..fibre import paths
from ..fibre.fresnel import bravais_indices
from ..fibre.marschner import Caustic, Settings

# Gauss-Legendre within a cell: attenuation is smooth in gamma, so the error of four nodes is below half floats.
NODES, WEIGHTS = np.polynomial.legendre.leggauss(4)
BAKING = "Baking tables"  # the progress step

Absorptions = Sequence[float] | np.ndarray  # sigma_a (C,)

_ROWS_AT_ONCE = 32  # keeps a block's rays in the processor's cache
# Gauss-Legendre over half the fiber, for light that leaves uniformly.
_WIDE_NODES, _WIDE_WEIGHTS = np.polynomial.legendre.leggauss(64)


def smooth_means(
    edges: np.ndarray, cosines: np.ndarray, settings: Settings, sigma_a: Absorptions, progress: Progress = no_progress
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return N_R (H, W, 1), N_TT and N_TRT (H, W, C) as means over the cells between `edges`, float32.

    edges: W + 1 monotone values of phi from 0 to pi or back; cosines (H,): of theta_d; sigma_a (C,). In the classic
    mode the caustic is treated as in `settings`, otherwise it is kept. progress(step, part): progress callback.
    """
    shape = (len(cosines), len(edges) - 1)
    n_r, n_tt, n_trt = (np.empty((*shape, count), np.float32) for count in (1, len(sigma_a), len(sigma_a)))
    for start in range(0, len(cosines), _ROWS_AT_ONCE):
        progress(BAKING, start / len(cosines))
        block = slice(start, start + _ROWS_AT_ONCE)
        n_r[block] = _cell_means(paths.R, edges, cosines[block], settings.eta, sigma_a)
        n_tt[block] = _cell_means(paths.TT, edges, cosines[block], settings.eta, sigma_a)
        n_trt[block] = _trt_cell_means(edges, cosines[block], settings, sigma_a)
    return n_r, n_tt, n_trt


def smooth_trt_means(edges: np.ndarray, cosines: np.ndarray, settings: Settings, sigma_a: Absorptions) -> np.ndarray:
    """Return only N_TRT (H, W, C) of `smooth_means`."""
    starts = range(0, len(cosines), _ROWS_AT_ONCE)
    blocks = [_trt_cell_means(edges, cosines[start : start + _ROWS_AT_ONCE], settings, sigma_a) for start in starts]
    return np.concatenate(blocks).astype(np.float32)


def residual(cosines: np.ndarray, eta: float, sigma_a: Absorptions) -> np.ndarray:
    """Return N (H, C) of all paths beyond TRT together, which leave evenly around the fiber; cosines (H,)."""
    gamma = 0.25 * np.pi * (1.0 + _WIDE_NODES)
    dh = 0.25 * np.pi * _WIDE_WEIGHTS * np.cos(gamma)  # half of the sum over both halves
    attenuated = paths.path_attenuation(paths.RESIDUAL, gamma, cosines[:, None], eta, sigma_a)
    return np.einsum("hnc,n->hc", attenuated, dh) * (0.5 / np.pi)


def _trt_cell_means(edges, cos_theta_d, settings, sigma_a):
    if settings.mode == "energy" or settings.caustic == "exact":
        return _cell_means(paths.TRT, edges, cos_theta_d, settings.eta, sigma_a)
    caustic = Caustic.at(cos_theta_d[:, None], settings, sigma_a)
    phi = 0.5 * (edges[:-1] + edges[1:]) + 0.5 * np.diff(edges) * NODES[:, None]  # (nodes, W)
    glint = sum(0.5 * weight * caustic.glint(row) for weight, row in zip(WEIGHTS, phi, strict=True))
    return _cell_means(paths.TRT, edges, cos_theta_d, settings.eta, sigma_a, caustic) + glint


def _cell_means(p, edges, cos_theta_d, eta, sigma_a, caustic=None):
    """Return means of N_p over cells of phi, (H, W, C): ½ ∫ A dh over the rays that leave through a cell, divided by
    its width. With a `Caustic` (H, 1), each ray is weighted by `Caustic.remainder` at its exit angle.
    """
    eta_prime, _ = bravais_indices(cos_theta_d[:, None], eta)
    light = np.zeros((len(cos_theta_d), len(edges) - 1, 1 if p == paths.R else len(sigma_a)))
    for gamma_edges in _gamma_edges(p, edges, eta_prime):
        half_width = 0.5 * np.diff(gamma_edges)
        row, cell = np.nonzero(half_width)  # cells that this segment reaches
        half_width = half_width[row, cell, None]
        gamma = gamma_edges[row, cell, None] + half_width * (1.0 + NODES)  # (cells, nodes)
        dh = 0.5 * np.cos(gamma) * np.abs(half_width) * WEIGHTS
        if caustic is not None:
            dh *= caustic.rows(row).remainder(paths.exit_angle(p, gamma, eta_prime[row]))
        attenuated = paths.path_attenuation(p, gamma, cos_theta_d[row, None], eta, sigma_a)
        light[row, cell] += np.einsum("nkc,nk->nc", attenuated, dh)
    return light / np.abs(np.diff(edges))[:, None]


def _gamma_edges(p, edges, eta_prime):
    """Return for each monotone segment (H, W + 1): gamma of the ray that leaves at each edge.

    Gamma is the nearer end of the segment if there is no such ray.

    Only phi >= 0 is covered; N is even. eta_prime (H, 1).
    """
    if p == paths.R:
        return [np.broadcast_to(-0.5 * edges, (len(eta_prime), len(edges)))]
    if p == paths.TT:
        return [paths.tt_gamma(edges, eta_prime)]
    return [_segment_edges(edges, eta_prime, *segment) for segment in paths.trt_segments(eta_prime)]


def _segment_edges(edges, eta_prime, low, high, slope_sign):
    phi_low, phi_high = paths.exit_angle(paths.TRT, low, eta_prime), paths.exit_angle(paths.TRT, high, eta_prime)
    gamma = np.where(slope_sign * (edges - phi_low) <= 0.0, low, high)
    row, edge = np.nonzero((edges - phi_low) * (edges - phi_high) < 0.0)
    found = (values[row, 0] for values in (low, high, slope_sign, eta_prime))
    gamma[row, edge] = paths.trt_gamma(edges[edge], *found)
    return gamma
