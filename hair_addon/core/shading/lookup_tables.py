# SPDX-License-Identifier: GPL-3.0-or-later
"""The three tables that a shader reads in place of the model: M, N and N_TRT ([Report12] section 3.2, [Nguyen05]).

    m      M_R, M_TT, M_TRT, cos(theta_d)    over theta_i (columns) and theta_o (rows)
    n      N_TT red, green, blue, N_R        over phi (columns) and cos(theta_d) (rows)
    n_trt  N_TRT red, green, blue            over the same

A texel is named by its middle, as a texture unit does it: column k of W lies at u = (k + 0.5) / W, row j of H at
v = (j + 0.5) / H. With the axes ANGLES, u of n is phi / pi; with COSINES, the report's, it is (cos(phi) + 1) / 2.
The azimuthal texels are averages over their cell of phi: the caustic of N_TRT is infinite in its middle and finite
in the mean. They are found by sending the light A dh of the rays that leave through a cell into that cell.
"""

from dataclasses import dataclass

import numpy as np

from ..params import param
from . import marschner, paths
from .angles import cos_theta_d
from .fresnel import bravais_indices

MAX_SIZE = 2048

# Gauss-Legendre within a cell: attenuation is smooth in gamma, and four nodes leave less than half floats can hold.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(4)
_ROWS_AT_ONCE = 32  # keeps a block's rays in the processor's cache


@dataclass(frozen=True)
class Settings(marschner.Settings):
    """The fibre, and the tables that stand for it."""

    size: int = param(256, "Width and height of each table", low=16, high=MAX_SIZE)
    axes: str = param(
        "ANGLES",
        "What the tables are indexed by",
        choices=(
            ("ANGLES", "Angles", "phi and the inclinations themselves: accurate up to grazing light"),
            ("COSINES", "Cosines", "Cosine of phi and sines of the inclinations, as in the report"),
        ),
    )


@dataclass(frozen=True, eq=False)
class Tables:
    """Float32 arrays of (size, size) texels, and the settings that they were baked with."""

    m: np.ndarray  # (H, W, 4)
    n: np.ndarray  # (H, W, 4)
    n_trt: np.ndarray  # (H, W, 3)
    settings: Settings


def bake(settings):
    """`Settings` → `Tables`."""
    centres = (np.arange(settings.size) + 0.5) / settings.size
    edges = phi_edges(settings)
    n = np.empty((settings.size, settings.size, 4), np.float32)
    n_trt = np.empty((settings.size, settings.size, 3), np.float32)
    for start in range(0, settings.size, _ROWS_AT_ONCE):
        block = slice(start, start + _ROWS_AT_ONCE)
        n[block, :, 0:3] = _cell_means(paths.TT, edges, centres[block], settings)
        n[block, :, 3:4] = _cell_means(paths.R, edges, centres[block], settings)
        n_trt[block] = _trt_cell_means(edges, centres[block], settings)
    return Tables(_longitudinal(settings, centres), n, n_trt, settings)


def phi_edges(settings):
    """Where the columns of n meet: W + 1 values of phi, from 0 to pi, or from pi to 0 with the axes COSINES."""
    u = np.arange(settings.size + 1) / settings.size
    return np.arccos(2.0 * u - 1.0) if settings.axes == "COSINES" else np.pi * u


def _longitudinal(settings, centres):
    theta = np.arcsin(2.0 * centres - 1.0) if settings.axes == "COSINES" else np.pi * (centres - 0.5)
    theta_h = 0.5 * (theta[:, None] + theta[None, :])
    lobes = [marschner.m_lobe(theta_h, alpha, beta) for alpha, beta in marschner.longitudinal_lobes(settings)]
    sines = np.sin(theta)
    return np.stack([*lobes, cos_theta_d(sines[None, :], sines[:, None])], axis=-1).astype(np.float32)


def _trt_cell_means(edges, cos_theta_d, settings):
    if settings.caustic == "exact":
        return _cell_means(paths.TRT, edges, cos_theta_d, settings)
    caustic = marschner.Caustic.at(cos_theta_d[:, None], settings)
    phi = 0.5 * (edges[:-1] + edges[1:]) + 0.5 * np.diff(edges) * _NODES[:, None]  # (nodes, W)
    glint = sum(0.5 * weight * caustic.glint(row) for weight, row in zip(_WEIGHTS, phi, strict=True))
    return _cell_means(paths.TRT, edges, cos_theta_d, settings, caustic) + glint


def _cell_means(p, edges, cos_theta_d, settings, caustic=None):
    """Means of N_p over cells of phi, (H, W, C): ½ int A dh over the rays that leave through a cell, by its width.

    With a `Caustic` (H, 1), each ray counts as much as the caustic treatment keeps of N_TRT where the ray leaves.
    """
    eta_prime, _ = bravais_indices(cos_theta_d[:, None], settings.eta)
    light = np.zeros((len(cos_theta_d), len(edges) - 1, 1 if p == paths.R else len(settings.sigma_a)))
    for gamma_edges in _gamma_edges(p, edges, eta_prime):
        half_width = 0.5 * np.diff(gamma_edges)
        row, cell = np.nonzero(half_width)  # cells that this segment reaches
        half_width = half_width[row, cell, None]
        gamma = gamma_edges[row, cell, None] + half_width * (1.0 + _NODES)  # (cells, nodes)
        dh = 0.5 * np.cos(gamma) * np.abs(half_width) * _WEIGHTS
        if caustic is not None:
            dh *= caustic.rows(row).kept(paths.exit_angle(p, gamma, eta_prime[row]))
        attenuated = paths.path_attenuation(p, gamma, cos_theta_d[row, None], settings.eta, settings.sigma_a)
        light[row, cell] += np.einsum("nkc,nk->nc", attenuated, dh)
    return light / np.abs(np.diff(edges))[:, None]


def _gamma_edges(p, edges, eta_prime):
    """For each monotone segment, (H, W + 1): gamma of the ray that leaves at each edge, else the segment's nearer end.

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


def m_coordinates(sin_theta_i, sin_theta_o, axes):
    """(u, v), each (...), of m."""
    sines = [np.clip(sine, -1.0, 1.0) for sine in (sin_theta_i, sin_theta_o)]
    return tuple(0.5 * sine + 0.5 if axes == "COSINES" else np.arcsin(sine) / np.pi + 0.5 for sine in sines)


def n_coordinates(phi, cos_theta_d, axes):
    """(u, v), each (...), of n and n_trt; phi in [-pi, pi]."""
    return (0.5 * np.cos(phi) + 0.5 if axes == "COSINES" else np.abs(phi) / np.pi), cos_theta_d


def sample(table, u, v):
    """(H, W, C) at coordinates (...) in [0, 1] → (..., C): bilinear, clamped to the edge, as a texture unit does it."""
    height, width = table.shape[:2]
    x = np.clip(np.asarray(u) * width - 0.5, 0.0, width - 1.0)
    y = np.clip(np.asarray(v) * height - 0.5, 0.0, height - 1.0)
    column = np.minimum(x.astype(int), width - 2)
    row = np.minimum(y.astype(int), height - 2)
    x = (x - column)[..., None]
    y = (y - row)[..., None]
    lower = (1.0 - x) * table[row, column] + x * table[row, column + 1]
    upper = (1.0 - x) * table[row + 1, column] + x * table[row + 1, column + 1]
    return (1.0 - y) * lower + y * upper


def sample_scattering(tables, angles):
    """S (..., 3) [1/sr] at `FibreAngles` (...), read from the tables: what the shader computes."""
    sin_theta_i, sin_theta_o = np.sin(angles.theta_i), np.sin(angles.theta_o)
    cosine = cos_theta_d(sin_theta_i, sin_theta_o)  # exact, where m's fourth channel is off by 0.014 near grazing
    at = n_coordinates(angles.phi, cosine, tables.settings.axes)
    m = sample(tables.m, *m_coordinates(sin_theta_i, sin_theta_o, tables.settings.axes))
    return marschner.marschner_scattering(m, sample(tables.n, *at), sample(tables.n_trt, *at), cosine)


def to_half(values):
    """Array → float16, clamped to the largest half float; subnormals become 0 (they cost fifty times as much)."""
    limit = np.finfo(np.float16)
    values = np.clip(values, float(limit.min), float(limit.max))
    return np.where(np.abs(values) < float(limit.tiny), 0.0, values).astype(np.float16)
