# SPDX-License-Identifier: GPL-3.0-or-later
"""Azimuthal roughness: the trimmed logistic of [Chiang16], and its convolution with tables.

N_p of a rough fiber is N_p of a smooth fiber, convolved over the circle of phi. So one matrix converts tables of smooth
fibers, whose texels are exact means, to tables of rough fibers: no energy is lost, and roughness 0 is the smooth table.
"""

import numpy as np

from .angles import Values


def trimmed_logistic(phi: Values, scale: Values) -> np.ndarray:
    """Return the density D_s (...) [1/rad] of the deflection phi in [-pi, pi]; scale s [rad]."""
    # The logistic density is 1 / (4 s cosh²(x / 2s)); this form does not overflow.
    decay = np.exp(-np.abs(phi) / scale)
    return decay / (scale * np.square(1.0 + decay) * np.tanh(0.5 * np.pi / scale))


def roughening(edges: np.ndarray, scale: Values) -> np.ndarray:
    """Return the (W, W) matrix that converts cell means (..., W) over phi of a smooth fiber's N to a rough fiber's.

    edges: W + 1 monotone values of phi from 0 to pi or back; scale s [rad].
    """
    return _spreading(edges, lambda x: _logistic_antiderivative(x, scale))


def forward_mean(edges: np.ndarray) -> np.ndarray:
    """Return the (W, W) matrix that averages N over light that strands have scattered forward, around each phi.

    The weight at a distance x is cos²(x) up to pi / 2. Its mean cosine, 8 / 3 pi or 0.85, is close to the mean
    cosine of light scattered forward by one fiber, 0.80 to 0.83 for brown to white hair. N^G of [Zinke08] weights the
    half circle uniformly (0.64), which light reaches after three fibers.
    """

    def second_antiderivative(x):
        inside = (0.5 * x * x + 0.25 * (1.0 - np.cos(2.0 * x))) / np.pi
        return np.where(x < 0.5 * np.pi, inside, np.pi / 8.0 + 0.5 / np.pi + 0.5 * (x - 0.5 * np.pi))

    return _spreading(edges, second_antiderivative)


def _spreading(edges, second_antiderivative):
    """Return the matrix of a convolution over the circle with an even density D on [-pi, pi], for means over cells.

    N is even in phi, so light comes from both sides. Each element is the exact mean of D over two cells, and each
    column sums to one, which conserves energy. second_antiderivative: G on [0, pi] with G'' = D, G(0) = G'(0) = 0.
    """
    # D(x - y) over the cell of y is D(x + y) over its mirror image.
    spread = sum(_cell_integrals(edges, image, second_antiderivative) for image in (-edges, edges))
    spread = np.maximum(spread, 0.0)  # rounding of the second differences
    widths = np.abs(np.diff(edges))
    return spread * (widths / spread.sum(axis=0)) / widths[:, None]


def _cell_integrals(x_edges, y_edges, second_antiderivative):
    """Return integrals (W, W) of D(x + y) over pairs of cells: second differences of G, continued around the circle."""
    x = np.abs(x_edges[:, None] + y_edges[None, :])  # up to 2 pi
    beyond = np.maximum(x - np.pi, 0.0)
    # Beyond pi, D is mirrored, so the integral C of D is replaced by 1 - C in the integrand of G.
    values = beyond + second_antiderivative(np.where(x > np.pi, np.pi - beyond, x))
    return np.abs(np.diff(np.diff(values, axis=0), axis=1))


def _logistic_antiderivative(x, scale):
    """Return the integral, from 0 to x in [0, pi], of C(x) = tanh(x / 2s) / (2 tanh(pi / 2s)), the integral of D_s."""
    half = 0.5 * x / scale
    log_cosh = half + np.log1p(np.exp(-2.0 * half)) - np.log(2.0)
    return scale * log_cosh / np.tanh(0.5 * np.pi / scale)
