# SPDX-License-Identifier: GPL-3.0-or-later
"""Lookup tables of the Marschner model: M, N and N_TRT ([Report12] section 3.2, [Nguyen05]).

In the classic mode:

    m      M_R, M_TT, M_TRT, cos(theta_d)    over theta_i (columns) and theta_o (rows)
    n      N_TT red, green, blue, N_R        over phi (columns) and cos(theta_d) (rows)
    n_trt  N_TRT red, green, blue            over the same

In the energy-conserving mode theta_o replaces theta_d, m contains the residual lobe instead of the cosine, and

    n_res  the residual's red, green, blue   over cos(theta_o) (rows), in one column, because it does not depend on phi

Coordinates address texel centers, as in a texture unit: column k of W is at u = (k + 0.5) / W, row j of H at
v = (j + 0.5) / H. With the axes ANGLES, u of n is phi / pi; with COSINES, the report's, it is (cos(phi) + 1) / 2.
The azimuthal texels are means over their cell of phi.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...long_work import Progress, no_progress
from ...params import param
from .. import tables
from ..fibre import energy_conserving, marschner
from ..fibre.angles import FibreAngles, Values, cos_theta_d
from ..fibre.azimuthal import roughening
from ..fibre.principled import scale_from_radial_roughness
from .cell_means import Absorptions, residual, smooth_means

MAX_SIZE = 2048

# N_R, N_TT, N_TRT and the residual's N, which the classic mode lacks.
Lobes = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray | None]


@dataclass(frozen=True)
class Settings(marschner.Settings):
    """Settings of a fiber and its tables."""

    size: int = param(
        256,
        "Resolution of each lookup table; higher values are more accurate and use more memory",
        low=16,
        high=MAX_SIZE,
    )
    axes: str = param(
        "ANGLES",
        "Coordinates of the lookup tables",
        choices=(
            ("ANGLES", "Angles", "Azimuth and inclination angles; accurate up to grazing light"),
            ("COSINES", "Cosines", "Cosine of the azimuth and sines of the inclinations, as in the original report"),
        ),
    )


@dataclass(frozen=True, eq=False)
class Tables:
    """Float32 arrays of (size, size) texels, and the settings that they were baked with."""

    m: np.ndarray  # (H, W, 4)
    n: np.ndarray  # (H, W, 4)
    n_trt: np.ndarray  # (H, W, 3)
    settings: Settings
    n_res: np.ndarray | None = None  # (H, 1, 3), of the energy-conserving mode

    @property
    def lobes(self) -> Lobes:
        """N_R (H, W, 1), N_TT and N_TRT (H, W, 3) and the residual's N (H, 1, 3), as `azimuthal_lobes` bakes them."""
        return self.n[..., 3:], self.n[..., :3], self.n_trt, self.n_res


def bake(settings: Settings, device: str = "cpu", progress: Progress = no_progress) -> Tables:
    """Bake `Tables`; device: a Warp device such as "cuda:0", or the CPU.

    progress(step, part): progress callback, may raise to cancel.
    """
    n_r, n_tt, n_trt, n_res = azimuthal_lobes(settings, settings.sigma_a, device, progress)
    m = _longitudinal(settings, device)
    return Tables(m, np.concatenate([n_tt, n_r], axis=-1), n_trt, settings, n_res)


def azimuthal_lobes(
    settings: Settings, sigma_a: Absorptions, device: str = "cpu", progress: Progress = no_progress
) -> Lobes:
    """Bake float32 N_R (H, W, 1), N_TT and N_TRT (H, W, C), the residual's N (H, 1, C) or None, for sigma_a (C,)."""
    edges, cosines = phi_edges(settings), row_cosines(settings)
    is_rough = settings.mode == "energy"
    n_res = residual(cosines, settings.eta, sigma_a)[:, None].astype(np.float32) if is_rough else None
    spread = None
    if is_rough:
        spread = roughening(edges, scale_from_radial_roughness(settings.radial_roughness)).astype(np.float32)
    if device != "cpu":
        lobes = tables.texel_kernels.azimuthal_means(edges, cosines, settings, sigma_a, spread, device)
    else:
        lobes = smooth_means(edges, cosines, settings, sigma_a, progress)
        lobes = lobes if spread is None else spread_columns(lobes, spread)
    n_r, n_tt, n_trt = lobes
    return n_r, n_tt, n_trt, n_res


def spread_columns(lobes: Sequence[np.ndarray], spread: np.ndarray) -> list[np.ndarray]:
    """Return cell means (H, W, C), of any C, whose columns are multiplied by a matrix (W, W), all in one product."""
    height, width, _channels = lobes[0].shape
    counts = [lobe.shape[2] for lobe in lobes]
    side_by_side = np.concatenate([lobe.swapaxes(1, 2) for lobe in lobes], axis=1)  # (H, channels, W)
    mixed = (side_by_side.reshape(-1, width) @ spread.T).reshape(height, -1, width).swapaxes(1, 2)
    return np.split(mixed, np.cumsum(counts)[:-1], axis=2)


def row_cosines(settings: Settings) -> np.ndarray:
    """Return cos(theta_d), or cos(theta_o) in the energy-conserving mode, of each row of n, (H,)."""
    return (np.arange(settings.size) + 0.5) / settings.size


def phi_edges(settings: Settings) -> np.ndarray:
    """Return the edges of the columns of n: W + 1 values of phi from 0 to pi, or from pi to 0 with the axes COSINES."""
    u = np.arange(settings.size + 1) / settings.size
    return np.arccos(2.0 * u - 1.0) if settings.axes == "COSINES" else np.pi * u


def _longitudinal(settings, device):
    centres = row_cosines(settings)
    theta = np.arcsin(2.0 * centres - 1.0) if settings.axes == "COSINES" else np.pi * (centres - 0.5)
    if device != "cpu":
        return tables.texel_kernels.longitudinal_texels(theta, settings, device)
    theta_o, theta_i = theta[:, None], theta[None, :]
    if settings.mode == "energy":
        return energy_conserving.m_lobes(theta_i, theta_o, settings).astype(np.float32)
    theta_h = 0.5 * (theta_o + theta_i)
    cosine = cos_theta_d(np.sin(theta_i), np.sin(theta_o))[..., None]
    return np.concatenate([marschner.gaussian_lobes(theta_h, settings), cosine], axis=-1).astype(np.float32)


def m_coordinates(sin_theta_i: Values, sin_theta_o: Values, axes: str) -> tuple[Values, Values]:
    """Return the coordinates (u, v), each (...), in m."""
    sines = (np.clip(sine, -1.0, 1.0) for sine in (sin_theta_i, sin_theta_o))
    u, v = (0.5 * sine + 0.5 if axes == "COSINES" else np.arcsin(sine) / np.pi + 0.5 for sine in sines)
    return u, v


def n_coordinates(phi: Values, cos_theta_d: Values, axes: str) -> tuple[Values, Values]:
    """Return the coordinates (u, v), each (...), in n and n_trt; phi in [-pi, pi]."""
    return (0.5 * np.cos(phi) + 0.5 if axes == "COSINES" else np.abs(phi) / np.pi), cos_theta_d


def sample(table: np.ndarray, u: Values, v: Values) -> np.ndarray:
    """Return samples (..., C) of (H, W, C) at coordinates (...) in [0, 1], as a texture unit: bilinear and clamped."""
    height, width = table.shape[:2]
    x = np.clip(np.asarray(u) * width - 0.5, 0.0, width - 1.0)
    y = np.clip(np.asarray(v) * height - 0.5, 0.0, height - 1.0)
    left, top = x.astype(int), y.astype(int)
    right, bottom = np.minimum(left + 1, width - 1), np.minimum(top + 1, height - 1)
    x = (x - left)[..., None]
    y = (y - top)[..., None]
    upper = (1.0 - x) * table[top, left] + x * table[top, right]
    lower = (1.0 - x) * table[bottom, left] + x * table[bottom, right]
    return (1.0 - y) * upper + y * lower


def sample_radiance(tables: Tables, angles: FibreAngles) -> np.ndarray:
    """Return radiance per irradiance (..., 3) at `FibreAngles` (...) from the tables: the shader's hair_bsdf()."""
    if tables.n_res is None:  # the classic mode
        return sample_scattering(tables, angles) * np.cos(angles.theta_i)[..., None]
    # M is evaluated: lobes of smooth hair are narrower than texels, and strands may differ in roughness.
    m = energy_conserving.m_lobes(angles.theta_i, angles.theta_o, tables.settings)
    u, v = n_coordinates(angles.phi, np.cos(angles.theta_o), tables.settings.axes)
    n_res = sample(tables.n_res, np.full_like(v, 0.5), v)
    return energy_conserving.lobe_sum(m, sample(tables.n, u, v), sample(tables.n_trt, u, v), n_res)


def sample_scattering(tables: Tables, angles: FibreAngles) -> np.ndarray:
    """Return S (..., 3) [1/sr] of the classic mode at `FibreAngles` (...) from the tables."""
    sin_theta_i, sin_theta_o = np.sin(angles.theta_i), np.sin(angles.theta_o)
    cosine = cos_theta_d(sin_theta_i, sin_theta_o)  # exact, where m's fourth channel is off by 0.014 near grazing
    at = n_coordinates(angles.phi, cosine, tables.settings.axes)
    m = sample(tables.m, *m_coordinates(sin_theta_i, sin_theta_o, tables.settings.axes))
    return marschner.marschner_scattering(m, sample(tables.n, *at), sample(tables.n_trt, *at), cosine)


def to_half(values: np.ndarray) -> np.ndarray:
    """Return float16, clamped to the largest half float; subnormals become 0, because they are fifty times slower."""
    limit = np.finfo(np.float16)
    values = np.clip(values, float(limit.min), float(limit.max))
    return np.where(np.abs(values) < float(limit.tiny), 0.0, values).astype(np.float16)
