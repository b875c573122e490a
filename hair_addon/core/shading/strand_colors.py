# SPDX-License-Identifier: GPL-3.0-or-later
"""Colors and roughness of strands from root to tip, for programs that take them for each point."""

import numpy as np

from . import appearance
from .appearance import Appearance
from .fibre import principled, strand_variation
from .fibre.pigment import color_from_sigma_a


def colors(look: Appearance, randoms: np.ndarray, point_count: int) -> np.ndarray:
    """Linear RGB (S, P, 3) float32 of a head of hair that were all like a point; randoms: (S,) numbers of strands.

    Points are evenly spaced along strands.
    """
    settings = appearance.strand_settings(look)
    differing = np.asarray(randoms) if settings.random_color > 0.0 else np.zeros(1)
    position = np.linspace(0.0, 1.0, point_count) if settings.has_gradient else np.zeros(1)
    sigma_a = strand_variation.strand_sigma_a(settings, differing[:, None], position[None])
    found = color_from_sigma_a(sigma_a, look.radial_roughness).astype(np.float32)
    return np.broadcast_to(found, (len(randoms), point_count, 3))


def roughness(look: Appearance, randoms: np.ndarray, point_count: int) -> np.ndarray:
    """(S, P) float32, the longitudinal roughness of each strand at all of its points."""
    look = appearance.shaded(look)
    found = principled.varied_roughness(look.roughness, look.random_roughness, randoms).astype(np.float32)
    return np.broadcast_to(found[:, None], (len(found), point_count))
