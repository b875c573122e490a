# SPDX-License-Identifier: GPL-3.0-or-later
"""Colors and roughness of strands from root to tip, for programs that read them at each point."""

import numpy as np

from . import appearance
from .appearance import Appearance
from .fibre import principled, strand_variation
from .fibre.pigment import color_from_sigma_a
from .strand_looks import StrandLooks, colors_of, gradient_of, roughness_of


def colors(
    look: Appearance, randoms: np.ndarray, point_count: int, strand_looks: StrandLooks | None = None
) -> np.ndarray:
    """Return linear RGB (S, P, 3) float32: at each point, the color of hair that is like this point everywhere.

    randoms: (S,) random numbers of strands; strand_looks: (S,) if maps vary them. Points are evenly spaced along
    strands.
    """
    if strand_looks is not None:
        sigma_a = strand_looks.sigma_a(gradient_of(look, np.linspace(0.0, 1.0, point_count))[None])
        return colors_of(look, strand_looks, sigma_a).astype(np.float32)
    differing, position = _variation(look, np.asarray(randoms), np.linspace(0.0, 1.0, point_count))
    return np.broadcast_to(_colors(look, differing[:, None], position[None]), (len(randoms), point_count, 3))


def colors_at(
    look: Appearance, randoms: np.ndarray, positions: np.ndarray, strand_looks: StrandLooks | None = None
) -> np.ndarray:
    """Return the colors (N, 3) at points; positions: (N,) from 0, root, to 1, tip.

    randoms, strand_looks: (N,) of their strands.
    """
    if strand_looks is not None:
        sigma_a = strand_looks.sigma_a(gradient_of(look, np.asarray(positions)))
        return colors_of(look, strand_looks, sigma_a).astype(np.float32)
    differing, position = _variation(look, np.asarray(randoms), np.asarray(positions))
    return np.broadcast_to(_colors(look, differing, position), (len(positions), 3))


def _variation(look, randoms, positions):
    """Return random numbers and positions, reduced to one value each if colors do not depend on them."""
    settings = appearance.strand_settings(look)
    return (
        randoms if settings.random_color > 0.0 else np.zeros(1),
        positions if settings.has_gradient else np.zeros(1),
    )


def _colors(look, randoms, positions):
    sigma_a = strand_variation.strand_sigma_a(appearance.strand_settings(look), randoms, positions)
    return color_from_sigma_a(sigma_a, look.radial_roughness).astype(np.float32)


def roughness(
    look: Appearance, randoms: np.ndarray, point_count: int, strand_looks: StrandLooks | None = None
) -> np.ndarray:
    """Return (S, P) float32: the longitudinal roughness of each strand, at all of its points."""
    if strand_looks is not None:
        found = roughness_of(look, strand_looks, randoms).astype(np.float32)
        return np.broadcast_to(found[:, None], (len(found), point_count))
    look = appearance.shaded(look)
    found = principled.varied_roughness(look.roughness, look.random_roughness, randoms).astype(np.float32)
    return np.broadcast_to(found[:, None], (len(found), point_count))
