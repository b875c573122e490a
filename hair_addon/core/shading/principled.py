# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's Principled Hair in our terms: its roughness sockets ↔ the widths of Marschner's lobes."""

import numpy as np

# Standard deviation in theta_i + theta_o of the R lobe = a b + c b² + d b^20 for the roughness b [Chiang16].
_LINEAR, _QUADRATIC, _STEEP = 0.726, 0.812, 3.7


def beta_r_from_roughness(roughness):
    """Longitudinal roughness in [0, 1] → beta_R [rad], the deviation in theta_h, half that in theta_i + theta_o."""
    return 0.5 * (_LINEAR * roughness + _QUADRATIC * roughness**2 + _STEEP * roughness**20)


def roughness_from_beta_r(beta_r):
    """beta_R [rad] → longitudinal roughness, held to [0, 1]; the inverse of `beta_r_from_roughness`."""
    roughness = np.linspace(0.0, 1.0, 4097)
    return float(np.interp(beta_r, beta_r_from_roughness(roughness), roughness))
