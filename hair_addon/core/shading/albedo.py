# SPDX-License-Identifier: GPL-3.0-or-later
"""What a fibre returns and passes on of light from everywhere: one number a channel."""

import numpy as np

from .dual_scattering import scattered_parts

_INCLINATIONS = 181


def mean_albedo(tables):
    """Radiance of a fibre in a uniform surrounding of radiance one, RGB (3,), the mean over all directions of view."""
    return sum(_means(tables))


def mean_forward(tables):
    """The part of `mean_albedo` that goes on into the half space behind the fibre, RGB (3,): a_f of [Zinke08]."""
    return _means(tables)[0]


def _means(tables):
    """What goes forward and backward, each (3,), the mean over all directions."""
    theta = np.pi * ((np.arange(_INCLINATIONS) + 0.5) / _INCLINATIONS - 0.5)
    return [np.average(parts.sum(axis=0), axis=0, weights=np.cos(theta)) for parts in scattered_parts(tables, theta)]
