# SPDX-License-Identifier: GPL-3.0-or-later
"""Energy-conserving rough fiber: R, TT, TRT and all longer paths [DEon11] [Chiang16], as in Cycles.

The radiance toward the viewer, for irradiance 1 on a plane facing the light, is the sum over the lobes p of
M_p(theta_i, theta_o) N_p(theta_o, phi). It is a density of the light's direction: a white fiber in uniform light has
exactly the radiance of that light, for any roughness and tilt. It is not reciprocal: N is evaluated at theta_o, because
paths through the fiber are traced from the viewer.
"""

import numpy as np

from . import paths
from .angles import FibreAngles, Values
from .azimuthal import trimmed_logistic
from .fresnel import bravais_indices
from .longitudinal import d_eon_lobe
from .marschner import LEAST_COS_THETA_D, Settings, longitudinal_lobes
from .principled import LEAST_VARIANCE, scale_from_radial_roughness, variance_from_roughness

LOBES = (paths.R, paths.TT, paths.TRT, paths.RESIDUAL)


def lobes(settings: Settings, roughness: Values | None = None) -> list[tuple[float, Values]]:
    """Return [(shift, v)] of the four lobes: center [rad] and variance [rad²] in theta_i + theta_o.

    roughness: (...) of varied strands; None: the roughness of the settings.
    """
    roughness = settings.roughness if roughness is None else roughness
    shifts = [2.0 * alpha for alpha, _beta in longitudinal_lobes(settings)]
    v = variance_from_roughness(roughness)
    coated = variance_from_roughness((1.0 - settings.coat) * roughness)
    narrow = np.maximum(0.25 * v, LEAST_VARIANCE)
    return [(shifts[0], coated), (shifts[1], narrow), (shifts[2], 4.0 * v), (0.0, 4.0 * v)]


def m_lobes(
    theta_i: Values, theta_o: Values, settings: Settings, roughness: Values | None = None, widening: Values = 0.0
) -> np.ndarray:
    """Return M_p (..., 4) at inclinations (...); roughness: as in `lobes`; widening: (...) added to each variance."""
    sin_i, cos_i = np.sin(theta_i), np.cos(theta_i)
    turned = [(theta_o - shift, v + widening) for shift, v in lobes(settings, roughness)]
    # A view rotated past the pole continues on the other side.
    return np.stack([d_eon_lobe(sin_i, cos_i, np.sin(to), np.abs(np.cos(to)), v) for to, v in turned], axis=-1)


def near_field_lobes(h: Values, phi: Values, cos_theta_o: Values, settings: Settings) -> np.ndarray:
    """Return A_p D_s (..., 4, C) of the ray that hits the fiber at the offset h (...) in [-1, 1]."""
    gamma = np.arcsin(h)
    eta_prime, _ = bravais_indices(cos_theta_o, settings.eta)
    scale = scale_from_radial_roughness(settings.radial_roughness)
    values = []
    for p in LOBES:
        attenuated = paths.path_attenuation(p, gamma, cos_theta_o, settings.eta, settings.sigma_a)
        if p == paths.RESIDUAL:
            spread = np.full_like(np.asarray(phi + gamma), 0.5 / np.pi)
        else:
            deflection = phi - paths.exit_angle(p, gamma, eta_prime)
            spread = trimmed_logistic((deflection + np.pi) % (2.0 * np.pi) - np.pi, scale)
        values.append(attenuated * spread[..., None])
    return np.stack(np.broadcast_arrays(*values), axis=-2)


def n_lobes(phi: Values, cos_theta_o: Values, settings: Settings, node_count: int = 200) -> np.ndarray:
    """Return N_p (..., 4, C) by quadrature: the mean of `near_field_lobes` over the fiber's width.

    With 200 nodes the error is below 1e-4 for a radial roughness of at least 0.15; `lookup_tables` uses exact means
    instead.
    """
    nodes, weights = np.polynomial.legendre.leggauss(node_count)
    gamma = 0.5 * np.pi * nodes
    dh = 0.5 * (0.5 * np.pi * weights) * np.cos(gamma)
    phi, cos_theta_o = np.broadcast_arrays(phi, np.maximum(cos_theta_o, LEAST_COS_THETA_D))
    rays = near_field_lobes(np.sin(gamma), phi[..., None], cos_theta_o[..., None], settings)
    return np.einsum("...npc,n->...pc", rays, dh)


def lobe_sum(m: np.ndarray, n: np.ndarray, n_trt: np.ndarray, n_res: np.ndarray) -> np.ndarray:
    """Return the sum of M_p N_p (..., 3); m (..., 4): M_R, M_TT, M_TRT, M_res; n (..., 4): N_TT, N_R; n_trt; n_res."""
    return m[..., 0:1] * n[..., 3:] + m[..., 1:2] * n[..., :3] + m[..., 2:3] * n_trt + m[..., 3:] * n_res


def scattering(angles: FibreAngles, settings: Settings) -> np.ndarray:
    """Return radiance per irradiance (..., C) at `FibreAngles` (...) from a fiber narrower than a pixel."""
    m = m_lobes(angles.theta_i, angles.theta_o, settings)
    return np.einsum("...p,...pc->...c", m, n_lobes(angles.phi, np.cos(angles.theta_o), settings))
