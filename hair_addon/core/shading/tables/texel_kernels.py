# SPDX-License-Identifier: GPL-3.0-or-later
"""The texels of `cell_means`, `azimuthal` and the M table, one thread each: for GPUs, which bake in milliseconds.

The kernels use double precision, because beside a caustic the width of a cell in gamma is a small difference. This file
imports Warp, so `lookup_tables` imports it only for devices other than the CPU, where NumPy bakes.
"""

import numpy as np
import warp as wp

from ...kernels import kernel_cache
from ..fibre import energy_conserving
from ..fibre.marschner import Caustic, longitudinal_lobes
from ..fibre.paths import TRT, TT, R
from ..fibre.scattering_kernel import attenuation, crossing_length, exit_angle, gaussian, reflectance, shifted_lobe
from .cell_means import NODES, WEIGHTS, Absorptions
from .lookup_tables import Settings

wp.set_module_options({"enable_backward": False})  # no gradients: half as long to compile

F = wp.float64

_PI = wp.constant(wp.float64(np.pi))
_HALF_PI = wp.constant(wp.float64(0.5 * np.pi))
_NODES = wp.constant(wp.types.vector(4, wp.float64)(*NODES))
_WEIGHTS = wp.constant(wp.types.vector(4, wp.float64)(*WEIGHTS))
_BISECTIONS = wp.constant(50)
_R, _TT, _TRT = (wp.constant(path) for path in (R, TT, TRT))


@wp.struct
class _Inclination:
    """The inclination of a table's row: sine and cosine of theta_d or theta_o, eta, and eta'."""

    sine: F
    cosine: F
    eta: F
    eta_prime: F


@wp.func
def _tt_gamma(phi: F, eta_prime: F):
    delta = F(0.5) * (_PI - phi)
    return wp.min(wp.atan2(eta_prime * wp.sin(delta), eta_prime * wp.cos(delta) - F(1.0)), _HALF_PI)


@wp.func
def _trt_exit(gamma: F, row: _Inclination):
    """Azimuth in (-pi, pi) in which TRT leaves."""
    return exit_angle(_TRT, wp.sin(gamma), gamma, row.sine, row.cosine, row.eta) - F(2.0) * _PI


@wp.func
def _trt_gamma(phi: F, low: F, high: F, slope_sign: F, row: _Inclination):
    """gamma of the ray that leaves at phi, within one monotone segment; its nearer end where none does."""
    if slope_sign * (phi - _trt_exit(low, row)) <= F(0.0):
        return low
    if slope_sign * (phi - _trt_exit(high, row)) >= F(0.0):
        return high
    below = low
    above = high
    for _step in range(_BISECTIONS):
        middle = F(0.5) * (below + above)
        if slope_sign * (_trt_exit(middle, row) - phi) < F(0.0):
            below = middle
        else:
            above = middle
    return F(0.5) * (below + above)


@wp.func
def _kept(phi: F, phi_c: F, fade: F, width: F):
    """Return the part of N_TRT that the treatment of the caustic keeps: `Caustic.remainder`."""
    peak = gaussian(F(0.0), width)
    left = F(1.0) - fade * gaussian(phi - phi_c, width) / peak
    return left * (F(1.0) - fade * gaussian(phi + phi_c, width) / peak)


@wp.func
def _send(
    path: int,
    low: F,
    high: F,
    cell_width: F,
    inclination: _Inclination,
    sigma_a: wp.array[F],
    caustic: wp.vec3d,
    row: int,
    column: int,
    # outputs
    out_n: wp.array3d[float],
):
    """Send the light A dh of the rays between two gamma into a cell, for each channel."""
    half_width = F(0.5) * (high - low)
    for node in range(4):
        gamma = low + half_width * (F(1.0) + _NODES[node])
        h = wp.sin(gamma)
        fresnel = reflectance(inclination.cosine * wp.cos(gamma), inclination.eta)
        length = crossing_length(h, inclination.sine, inclination.cosine, inclination.eta)
        light = F(0.5) * wp.cos(gamma) * wp.abs(half_width) * _WEIGHTS[node] / cell_width
        if path == _TRT and caustic[2] > F(0.0):
            light = light * _kept(_trt_exit(gamma, inclination), caustic[0], caustic[1], caustic[2])
        for channel in range(out_n.shape[2]):
            left = attenuation(path, fresnel, wp.exp(-sigma_a[channel] * length))
            out_n[row, column, channel] = out_n[row, column, channel] + float(light * left)


@wp.kernel
def _smooth_texels(
    edges: wp.array[F],
    cosines: wp.array[F],
    eta: F,
    sigma_a: wp.array[F],
    phi_c: wp.array[F],
    fade: wp.array[F],
    glint_area: wp.array2d[F],
    glint_width: F,  # 0: no caustic treatment
    # outputs
    out_n_r: wp.array3d[float],
    out_n_tt: wp.array3d[float],
    out_n_trt: wp.array3d[float],
):
    row, column = wp.tid()
    cosine = cosines[row]
    first = edges[column]
    last = edges[column + 1]
    width = wp.abs(last - first)
    inclination = _Inclination()
    inclination.sine = wp.sqrt((F(1.0) - cosine) * (F(1.0) + cosine))
    inclination.cosine = cosine
    inclination.eta = eta
    inclination.eta_prime = wp.sqrt(eta * eta - F(1.0) + cosine * cosine) / cosine
    eta_prime = inclination.eta_prime
    caustic = wp.vec3d(phi_c[row], fade[row], glint_width)

    _send(_R, F(-0.5) * first, F(-0.5) * last, width, inclination, sigma_a, caustic, row, column, out_n_r)
    low = _tt_gamma(first, eta_prime)
    high = _tt_gamma(last, eta_prime)
    if low != high:
        _send(_TT, low, high, width, inclination, sigma_a, caustic, row, column, out_n_tt)

    sin_squared = (F(4.0) - eta_prime * eta_prime) / F(3.0)
    gamma_c = _HALF_PI
    middle_slope = F(-1.0)
    if sin_squared > F(0.0):
        gamma_c = wp.asin(wp.sqrt(sin_squared))
        middle_slope = F(1.0)
    for segment in range(3):
        start = -_HALF_PI
        end = -gamma_c
        slope_sign = F(-1.0)
        if segment == 1:
            start = -gamma_c
            end = gamma_c
            slope_sign = middle_slope
        if segment == 2:
            start = gamma_c
            end = _HALF_PI
        low = _trt_gamma(first, start, end, slope_sign, inclination)
        high = _trt_gamma(last, start, end, slope_sign, inclination)
        if low != high:
            _send(_TRT, low, high, width, inclination, sigma_a, caustic, row, column, out_n_trt)

    if glint_width > F(0.0):
        glint = F(0.0)
        for node in range(4):
            phi = F(0.5) * (first + last) + F(0.5) * (last - first) * _NODES[node]
            both = gaussian(phi - phi_c[row], glint_width) + gaussian(phi + phi_c[row], glint_width)
            glint += F(0.5) * _WEIGHTS[node] * both
        for channel in range(sigma_a.shape[0]):
            added = float(glint * glint_area[row, channel])
            out_n_trt[row, column, channel] = out_n_trt[row, column, channel] + added


@wp.kernel
def _spread_texels(
    spread: wp.array2d[float],
    n: wp.array3d[float],
    # outputs
    out_n: wp.array3d[float],
):
    row, column, channel = wp.tid()
    total = float(0.0)
    for source in range(n.shape[1]):
        total += spread[column, source] * n[row, source, channel]
    out_n[row, column, channel] = total


@wp.kernel
def _d_eon_texels(
    theta: wp.array[F],
    lobes: wp.array2d[F],  # shift and variance of each
    # outputs
    out_m: wp.array3d[float],
):
    row, column, lobe = wp.tid()
    v = lobes[lobe, 1]
    theta_i = theta[column]
    theta_o = theta[row]
    shift = lobes[lobe, 0]
    value = shifted_lobe(wp.sin(theta_i), wp.cos(theta_i), wp.sin(theta_o), wp.cos(theta_o), shift, v)
    out_m[row, column, lobe] = float(value)


@wp.kernel
def _gaussian_texels(
    theta: wp.array[F],
    lobes: wp.array2d[F],  # alpha and beta of each
    # outputs
    out_m: wp.array3d[float],
):
    row, column, lobe = wp.tid()
    if lobe == 3:
        out_m[row, column, lobe] = float(wp.cos(F(0.5) * (theta[row] - theta[column])))
    else:
        theta_h = F(0.5) * (theta[row] + theta[column])
        out_m[row, column, lobe] = float(F(0.5) * gaussian(theta_h - lobes[lobe, 0], lobes[lobe, 1]))


def azimuthal_means(
    edges: np.ndarray,
    cosines: np.ndarray,
    settings: Settings,
    sigma_a: Absorptions,
    spread: np.ndarray | None,
    device: str,
) -> list[np.ndarray]:
    """Return N_R (H, W, 1), N_TT and N_TRT (H, W, C), NumPy float32, baked on a Warp device.

    Arguments as in `cell_means.smooth_means`; spread: the matrix (W, W) of `azimuthal.roughening`, or None.
    """
    is_treated = settings.mode == "classic" and settings.caustic == "published"
    caustic = Caustic.at(cosines, settings, sigma_a)
    rows = (caustic.phi_c, caustic.fade, caustic.area)
    shape = (len(cosines), len(edges) - 1)
    # `wp.ScopedDevice` would change the default device of all threads, and viewports bake in a thread.
    given = (edges, cosines, sigma_a, *rows)
    sent = [wp.array(np.ascontiguousarray(values), dtype=F, device=device) for values in given]
    lobes = [wp.zeros((*shape, count), dtype=float, device=device) for count in (1, len(sigma_a), len(sigma_a))]
    inputs = [*sent[:2], F(settings.eta), *sent[2:], F(settings.glint_width if is_treated else 0.0)]
    kernel_cache.launch(_smooth_texels, dim=shape, inputs=inputs, outputs=lobes, device=device)
    if spread is not None:
        smooth, matrix = lobes, wp.array(spread, dtype=float, device=device)
        lobes = [wp.empty_like(lobe) for lobe in smooth]
        for source, target in zip(smooth, lobes, strict=True):
            inputs = [matrix, source]
            kernel_cache.launch(_spread_texels, dim=target.shape, inputs=inputs, outputs=[target], device=device)
    return [lobe.numpy() for lobe in lobes]


def longitudinal_texels(theta: np.ndarray, settings: Settings, device: str) -> np.ndarray:
    """Return M (H, W, 4), NumPy float32, baked on a Warp device; theta (W,): inclinations of columns and rows."""
    is_energy = settings.mode == "energy"
    lobes = energy_conserving.lobes(settings) if is_energy else longitudinal_lobes(settings)
    m = wp.empty((len(theta), len(theta), 4), dtype=float, device=device)
    inputs = [wp.array(values, dtype=F, device=device) for values in (theta, np.array(lobes, float))]
    kernel = _d_eon_texels if is_energy else _gaussian_texels
    kernel_cache.launch(kernel, dim=m.shape, inputs=inputs, outputs=[m], device=device)
    return m.numpy()
