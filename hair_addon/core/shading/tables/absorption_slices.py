# SPDX-License-Identifier: GPL-3.0-or-later
"""N for a range of absorptions: one 3D texture for every strand, point and color channel.

N of a channel depends only on its absorption. So a slice of one scalar sigma_a serves red, green and blue, and a shader
reads three times, instead of reading the three channels of `lookup_tables` once.

    n    N_TT, N_TRT, N of the residual, N_R    over phi (columns), cos(theta) (rows) and sqrt(sigma_a) (slices)
    n_g  the same, averaged over directions as in `dual_scattering`; energy-conserving mode
    n_trt  N_TRT of the four layers of `elliptic_section`; classic mode

Columns and rows are those of `lookup_tables`. Slice k of K is at sqrt(sigma_a) = low + (high - low) k / (K - 1): the
first and the last slice are the ends of the range. Between slices values are interpolated geometrically in sigma_a:
light along one path decreases exponentially with absorption, and the mean over many paths almost so.
"""

from dataclasses import dataclass, replace

import numpy as np

from ...params import Settings as _Settings
from ...params import param
from ..fibre import energy_conserving, marschner
from ..fibre.angles import FibreAngles, Values, cos_theta_d
from ..fibre.azimuthal import forward_mean
from ..fibre.elliptic_section import layer_etas, layer_weights
from . import lookup_tables
from .cell_means import smooth_trt_means

SLICE_COUNT = 16
_DARKEST = 2.0**-14  # values below the smallest normal half float count as black


@dataclass(frozen=True)
class Range(_Settings):
    """Range of the slices."""

    low: float = param(0.0, "Least sqrt(sigma_a)", low=0.0)
    high: float = param(1.0, "Greatest sqrt(sigma_a)", low=0.0)


@dataclass(frozen=True, eq=False)
class Slices:
    """Float32 texels, the range that they cover, and the settings (without sigma_a) of their bake."""

    n: np.ndarray  # (K, H, W, 4)
    n_g: np.ndarray | None  # (K, H, W, 4)
    range: Range
    settings: lookup_tables.Settings
    n_trt: np.ndarray | None = None  # (K, H, W, 4), for elliptic sections

    @property
    def lobes(self) -> lookup_tables.Lobes:
        """N_R (H, W, 1), N_TT and N_TRT (H, W, K) and the residual's N (H, 1, K), as `azimuthal_lobes` bakes them."""
        n_tt, n_trt, n_res = self.n[..., :3].transpose(3, 1, 2, 0)
        return self.n[0, ..., 3:], n_tt, n_trt, n_res[:, :1]


def bake(
    settings: lookup_tables.Settings,
    sigma_a_range: tuple[float, float],
    slice_count: int = SLICE_COUNT,
    device: str = "cpu",
) -> Slices:
    """Bake `Slices` for a range (least, greatest) of sigma_a. The settings' own sigma_a is not used."""
    covered = Range(*(float(end) for end in np.sqrt(sigma_a_range)))
    sigma_a = np.square(np.linspace(covered.low, covered.high, slice_count))
    n_r, n_tt, n_trt, n_res = lookup_tables.azimuthal_lobes(settings, sigma_a, device)
    if settings.mode == "classic":
        elliptic = _elliptic_trt(settings, sigma_a, device) if settings.is_elliptic else None
        return Slices(_texels(n_r, n_tt, n_trt, 0.0), None, covered, settings, elliptic)
    mean = forward_mean(lookup_tables.phi_edges(settings)).astype(np.float32)
    r_g, tt_g, trt_g = lookup_tables.spread_columns((n_r, n_tt, n_trt), mean)
    n, n_g = _texels(n_r, n_tt, n_trt, n_res), _texels(r_g, tt_g, trt_g, n_res)
    return Slices(n, n_g, covered, settings)


def _elliptic_trt(settings, sigma_a, device):
    """Return N_TRT (K, H, W, 4) for indices from eta*_1 to eta*_2."""
    layers = [replace(settings, eta=float(eta)) for eta in layer_etas(settings.eta, settings.eccentricity)]
    if device == "cpu":
        edges, cosines = lookup_tables.phi_edges(settings), lookup_tables.row_cosines(settings)
        lobes = [smooth_trt_means(edges, cosines, layer, sigma_a) for layer in layers]
    else:
        lobes = [lookup_tables.azimuthal_lobes(layer, sigma_a, device)[2] for layer in layers]
    return np.moveaxis(np.stack(lobes, axis=-1), 2, 0)


def _texels(n_r, n_tt, n_trt, n_res):
    """Return texels (K, H, W, 4) of lobes, which broadcast to (H, W, K)."""
    height, width, slice_count = n_tt.shape
    texels = np.empty((slice_count, height, width, 4), np.float32)
    for channel, lobe in enumerate((n_tt, n_trt, n_res, n_r)):
        texels[..., channel] = np.moveaxis(np.broadcast_to(lobe, n_tt.shape), -1, 0)
    return texels


def sample_lobes(
    texels: np.ndarray, covered: Range, u: Values, v: Values, sigma_a: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the arguments of `energy_conserving.lobe_sum` except M, at coordinates (...), for sigma_a (..., 3).

    texels (K, H, W, 4): n or n_g; returns N_TT and N_R (..., 4), N_TRT and N of the residual (..., 3).
    """
    channels = [sample(texels, covered, u, v, sigma_a[..., channel]) for channel in range(3)]
    n_tt, n_trt, n_res = (np.stack([channel[..., lobe] for channel in channels], axis=-1) for lobe in range(3))
    return np.concatenate([n_tt, channels[0][..., 3:]], axis=-1), n_trt, n_res


def sample(texels: np.ndarray, covered: Range, u: Values, v: Values, sigma_a: np.ndarray) -> np.ndarray:
    """Return (N_TT, N_TRT, N of the residual, N_R), (..., 4), at coordinates (...) and scalar absorptions (...)."""
    u, v = np.asarray(u), np.asarray(v)
    below, fraction = slice_of(sigma_a, covered.low, covered.high, len(texels))
    ends = np.empty((2, *np.shape(below), 4))
    for index in np.unique(below):
        where = below == index
        for end in (0, 1):
            ends[end][where] = lookup_tables.sample(texels[index + end], u[where], v[where])
    return geometric_mix(ends[0], ends[1], fraction[..., None])


def slice_of(sigma_a: np.ndarray, low: float, high: float, slice_count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the slice below sigma_a (...), and the fraction (...) of the distance to the next slice, in sigma_a."""
    step = max(high - low, 1e-6) / (slice_count - 1)
    below = np.clip((np.sqrt(sigma_a) - low) / step, 0.0, slice_count - 2).astype(int)
    ends = np.square(low + step * below), np.square(low + step * (below + 1))
    return below, np.clip((sigma_a - ends[0]) / (ends[1] - ends[0]), 0.0, 1.0)


def geometric_mix(a: np.ndarray, b: np.ndarray, fraction: np.ndarray) -> np.ndarray:
    """Return a^(1 - fraction) b^fraction, linear below `_DARKEST`: either end may be black."""
    a, b = a + _DARKEST, b + _DARKEST
    return a * np.power(b / a, fraction) - _DARKEST


def sample_radiance(
    slices: Slices,
    angles: FibreAngles,
    sigma_a: np.ndarray,
    roughness: Values | None = None,
    cos_twice_phi_h: np.ndarray | None = None,
) -> np.ndarray:
    """Return radiance per irradiance (..., 3) at `FibreAngles` (...) of strands with sigma_a (..., 3), like the shader.

    roughness: (...) of varied strands; None: the settings' own; cos_twice_phi_h (...): as in `elliptic_section`, for
    elliptic sections.
    """
    settings = slices.settings
    if settings.mode == "energy":
        at = lookup_tables.n_coordinates(angles.phi, np.cos(angles.theta_o), settings.axes)
        m = energy_conserving.m_lobes(angles.theta_i, angles.theta_o, settings, roughness)
        return energy_conserving.lobe_sum(m, *sample_lobes(slices.n, slices.range, *at, sigma_a))
    cosine = cos_theta_d(np.sin(angles.theta_i), np.sin(angles.theta_o))
    at = lookup_tables.n_coordinates(angles.phi, cosine, settings.axes)
    n, n_trt, _none = sample_lobes(slices.n, slices.range, *at, sigma_a)
    if slices.n_trt is not None:
        if cos_twice_phi_h is None:
            raise ValueError("An elliptic section scatters by cos_twice_phi_h.")
        weights = layer_weights(cos_twice_phi_h)
        channels = [sample(slices.n_trt, slices.range, *at, sigma_a[..., channel]) for channel in range(3)]
        n_trt = np.stack([np.sum(weights * channel, axis=-1) for channel in channels], axis=-1)
    m = marschner.gaussian_lobes(
        angles.theta_h, settings, None if roughness is None else marschner.beta_r_of(roughness)
    )
    return marschner.marschner_scattering(m, n, n_trt, cosine) * np.cos(angles.theta_i)[..., None]
