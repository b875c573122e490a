# SPDX-License-Identifier: GPL-3.0-or-later
"""How a rough fibre spreads light in azimuth: the trimmed logistic of [Chiang16], and what it does to a table.

A rough fibre's N_p is a smooth one's, convolved over the circle of phi. So tables of rough fibres come from those of
smooth ones, whose texels are exact means, by one matrix: no energy is lost, and roughness 0 is the smooth table.
"""

import numpy as np


def trimmed_logistic(phi, scale):
    """Density D_s (...) [1/rad] of the deflection phi in [-pi, pi]; scale s [rad]."""
    # The logistic density is 1 / (4 s cosh²(x / 2s)); this form has nothing that overflows.
    decay = np.exp(-np.abs(phi) / scale)
    return decay / (scale * np.square(1.0 + decay) * np.tanh(0.5 * np.pi / scale))


def roughening(edges, scale):
    """(W, W) matrix that turns the cell means of a smooth N over phi (..., W) into those of a rough one.

    edges: W + 1 monotone values of phi from 0 to pi or back. N is even in phi, so light comes from both sides. Each
    element is the exact mean of D_s over two cells, and each column spreads exactly what it was given.
    """
    # D(x - y) over the cell of y is D(x + y) over its mirror image.
    spread = _cell_integrals(edges, -edges, scale) + _cell_integrals(edges, edges, scale)
    spread = np.maximum(spread, 0.0)  # rounding of the second differences
    widths = np.abs(np.diff(edges))
    return spread * (widths / spread.sum(axis=0)) / widths[:, None]


def _cell_integrals(x_edges, y_edges, scale):
    """Integrals (W, W) of D(x + y) over pairs of cells: second differences of its second antiderivative."""
    values = _second_antiderivative(x_edges[:, None] + y_edges[None, :], scale)
    return np.abs(np.diff(np.diff(values, axis=0), axis=1))


def _second_antiderivative(x, scale):
    """G (...) with G'' = D_s, continued around the circle, for x in [-pi, 2 pi]."""
    x = np.abs(x)
    beyond = np.maximum(x - np.pi, 0.0)
    # From pi on D is its mirror image, so G is the area under 1 - C where C was.
    return np.where(x > np.pi, beyond + _within(np.pi - beyond, scale), _within(x, scale))


def _within(x, scale):
    """Integral of C(x) = tanh(x / 2s) / (2 tanh(pi / 2s)), itself the integral of D_s, from 0 to x in [0, pi]."""
    half = 0.5 * x / scale
    log_cosh = half + np.log1p(np.exp(-2.0 * half)) - np.log(2.0)
    return scale * log_cosh / np.tanh(0.5 * np.pi / scale)
