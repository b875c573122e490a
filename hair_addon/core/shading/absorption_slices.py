# SPDX-License-Identifier: GPL-3.0-or-later
"""N for a range of absorptions: one texture in three dimensions that serves every strand, point and colour channel.

N depends on each channel's absorption alone. So a slice of one scalar sigma_a serves red, green and blue, and a shader
looks up three times where `lookup_tables` has the three channels side by side.

    n   N_TT, N_TRT, N of the residual, N_R    over phi (columns), cos(theta) (rows) and sqrt(sigma_a) (slices)

Columns and rows are those of `lookup_tables`. Slice k of K lies at sqrt(sigma_a) = low + (high - low) k / (K - 1): the
first and the last hold the ends of the range. Between slices values are interpolated geometrically in sigma_a: light
along one way falls exponentially with absorption, and the mean over many ways almost so.
"""

from dataclasses import dataclass

import numpy as np

from . import energy_conserving, lookup_tables, marschner
from .angles import cos_theta_d

SLICE_COUNT = 16
_DARKEST = 2.0**-14  # below the smallest normal half float there is nothing to be told from black


@dataclass(frozen=True, eq=False)
class Slices:
    """Float32 texels, the range of sqrt(sigma_a) that they cover, and the settings (less sigma_a) of their bake."""

    n: np.ndarray  # (K, H, W, 4)
    low: float
    high: float
    settings: lookup_tables.Settings


def bake(settings, sigma_a_range, slice_count=SLICE_COUNT, device="cpu"):
    """`lookup_tables.Settings`, (least, greatest) sigma_a → `Slices`. The settings' own sigma_a is not used."""
    low, high = np.sqrt(sigma_a_range)
    sigma_a = np.square(np.linspace(low, high, slice_count))
    n_r, n_tt, n_trt, n_res = lookup_tables.azimuthal_lobes(settings, sigma_a, device)
    n = np.zeros((slice_count, settings.size, settings.size, 4), np.float32)
    n[..., 0] = np.moveaxis(n_tt, -1, 0)
    n[..., 1] = np.moveaxis(n_trt, -1, 0)
    if n_res is not None:
        n[..., 2] = np.moveaxis(n_res, -1, 0)
    n[..., 3] = n_r[..., 0]
    return Slices(n, float(low), float(high), settings)


def sample(slices, u, v, sigma_a):
    """(N_TT, N_TRT, N of the residual, N_R), (..., 4), at coordinates (...) and scalar absorptions (...)."""
    below, fraction = slice_of(sigma_a, slices.low, slices.high, len(slices.n))
    ends = np.empty((2, *np.shape(below), 4))
    for index in np.unique(below):
        where = below == index
        for end in (0, 1):
            ends[end][where] = lookup_tables.sample(slices.n[index + end], u[where], v[where])
    return geometric_mix(ends[0], ends[1], fraction[..., None])


def slice_of(sigma_a, low, high, slice_count):
    """The slice below sigma_a (...), and which part (...) of the way to the next one in sigma_a it lies at."""
    step = max(high - low, 1e-6) / (slice_count - 1)
    below = np.clip((np.sqrt(sigma_a) - low) / step, 0.0, slice_count - 2).astype(int)
    ends = np.square(low + step * below), np.square(low + step * (below + 1))
    return below, np.clip((sigma_a - ends[0]) / (ends[1] - ends[0]), 0.0, 1.0)


def geometric_mix(a, b, fraction):
    """a^(1 - fraction) b^fraction, down to a darkness below which it becomes linear: black may be either end."""
    a, b = a + _DARKEST, b + _DARKEST
    return a * np.power(b / a, fraction) - _DARKEST


def sample_radiance(slices, angles, sigma_a):
    """Radiance per irradiance (..., 3) at `FibreAngles` (...) of strands with sigma_a (..., 3): the shader's twin."""
    settings = slices.settings
    is_classic = settings.mode == "classic"
    sines = np.sin(angles.theta_i), np.sin(angles.theta_o)
    cosine = cos_theta_d(*sines) if is_classic else np.cos(angles.theta_o)
    at = lookup_tables.n_coordinates(angles.phi, cosine, settings.axes)
    channels = [sample(slices, *at, sigma_a[..., channel]) for channel in range(3)]
    n_tt, n_trt, n_res = (np.stack([channel[..., lobe] for channel in channels], axis=-1) for lobe in range(3))
    n = np.concatenate([n_tt, channels[0][..., 3:]], axis=-1)
    if is_classic:
        theta_h = angles.theta_h[..., None]
        alpha, beta = np.transpose(marschner.longitudinal_lobes(settings))
        m = marschner.m_lobe(theta_h, alpha, beta)
        return marschner.marschner_scattering(m, n, n_trt, cosine) * np.cos(angles.theta_i)[..., None]
    m = energy_conserving.m_lobes(angles.theta_i, angles.theta_o, settings)
    return energy_conserving.lobe_sum(m, n, n_trt, n_res)
