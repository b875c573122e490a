# SPDX-License-Identifier: GPL-3.0-or-later
"""Multiple scattering: tables of dual scattering [Zinke08], from the tables of one fiber, and light among strands.

Of the light that hits a strand, a_f is scattered forward and a_b backward, with variances beta_f² and beta_b². All are
per color channel and depend on the inclination of the light. Front and back are the two halves of the circle of phi.
The light's azimuth may be anywhere in its half, so of light scattered by phi the fraction |phi| / pi goes forward. Both
parts give the two fluxes through a layer of strands [Kubelka31]; [Zinke08] neglects repeated backward scattering, and
assumes an infinitely deep layer behind a strand.
"""

from dataclasses import dataclass

import numpy as np

from ..fibre import energy_conserving, marschner
from ..fibre.angles import FibreAngles, Values
from ..fibre.azimuthal import forward_mean
from ..fibre.longitudinal import d_eon_lobe
from . import lookup_tables

SAMPLE_COUNT = 128  # over theta

# Rows of `DualTables.theta`, in order.
QUANTITIES = ("a_f", "a_b", "alpha_f", "alpha_b", "beta_f", "beta_b", "back", "back_shift", "back_width")

# Of one strand, and of deep hair: without any loss, fluxes would not decrease exponentially.
_LEAST_ATTENUATION, _MOST_REFLECTANCE = 1e-3, 0.995

_LEAST_COSINE, _LEAST_FLUX = 1e-3, 1e-6  # lower limits of the mean cosine and of fluxes

_WHITEST = 0.99  # so that the series over scattering events converges


@dataclass(frozen=True, eq=False)
class DualTables:
    """Float32 arrays, and the settings that they belong to.

    theta: rows as in `QUANTITIES`, column k of K at theta = ((k + 0.5) / K - 0.5) pi, the light's inclination; angles
    are of theta_h. n_g, n_g_trt: means of N for light scattered forward, with the axes and channels of n, n_trt.
    """

    theta: np.ndarray  # (9, K, 3)
    n_g: np.ndarray  # (H, W, 4)
    n_g_trt: np.ndarray  # (H, W, 3)
    settings: lookup_tables.Settings

    def at(self, quantity: str, theta: Values) -> np.ndarray:
        """Return a quantity (..., 3) at inclinations (...), sampled as by a texture unit."""
        row = self.theta[QUANTITIES.index(quantity)][None]
        u = np.asarray(theta) / np.pi + 0.5
        return lookup_tables.sample(row, u, np.full_like(u, 0.5))


def light_inclinations(count: int = SAMPLE_COUNT) -> np.ndarray:
    """Return theta (count,) of the tables' columns."""
    return np.pi * ((np.arange(count) + 0.5) / count - 0.5)


def bake(tables: lookup_tables.Tables) -> DualTables:
    """Return the `DualTables` of `lookup_tables.Tables`."""
    forward, backward = scattered_parts(tables, light_inclinations())
    rows = quantities(forward, backward, tables.settings)
    mean = forward_mean(lookup_tables.phi_edges(tables.settings)).astype(np.float32)
    n_g, n_g_trt = lookup_tables.spread_columns((tables.n, tables.n_trt), mean)
    return DualTables(rows, n_g, n_g_trt, tables.settings)


def quantities(forward: np.ndarray, backward: np.ndarray, settings: lookup_tables.Settings) -> np.ndarray:
    """Return the rows of `DualTables.theta`, (9, T, C) float32, from both `scattered_parts`, (4, T, C) each."""
    a_f, a_b = (np.minimum(parts.sum(axis=0), _WHITEST) for parts in (forward, backward))
    alpha, beta = _centres_and_widths(settings)
    alpha_f, alpha_b = (_weighted(alpha, parts) for parts in (forward, backward))
    beta_f, beta_b = (np.sqrt(_weighted(np.square(beta), parts)) for parts in (forward, backward))
    back = back_scattering(a_f, a_b, alpha_f, alpha_b, beta_f, beta_b)
    return np.stack([a_f, a_b, alpha_f, alpha_b, beta_f, beta_b, *back]).astype(np.float32)


def scattered_parts(tables: lookup_tables.Tables, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return (forward, backward), each (4, T, 3): scattering by R, TT, TRT and residual; theta: (T,), of the light."""
    return lobe_parts(tables.lobes, tables.settings, theta)


def lobe_parts(
    lobes: lookup_tables.Lobes, settings: lookup_tables.Settings, theta: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return `scattered_parts`, (4, T, C) each, of the lobes from `azimuthal_lobes`."""
    edges = lookup_tables.phi_edges(settings)
    widths = 2.0 * np.abs(np.diff(edges))  # twice: N is even in phi
    ahead = 0.5 * (edges[1:] + edges[:-1]) / np.pi
    rows = row_weights(settings, theta)
    return lobe_albedos(lobes, widths * ahead, rows), lobe_albedos(lobes, widths * (1.0 - ahead), rows)


def lobe_albedos(lobes: lookup_tables.Lobes, weights: np.ndarray, rows: list[np.ndarray]) -> np.ndarray:
    """Return (4, T, C): integrals of lobes over phi, with weights (W,) of the columns, and over the other inclination.

    rows: the `row_weights` of theta (T,), the viewer's in the energy-conserving mode; the classic mode is symmetric in
    light and viewer.
    """
    *narrow, n_res = lobes
    n_r, n_tt, n_trt = (np.einsum("hwc,w->hc", lobe, weights) for lobe in narrow)
    around = [np.repeat(n_r, n_tt.shape[1], axis=1), n_tt, n_trt]
    around.append(np.zeros_like(n_tt) if n_res is None else n_res[:, 0] * weights.sum())
    return np.stack([weights_of_rows @ lobe for weights_of_rows, lobe in zip(rows, around, strict=True)])


def row_weights(settings: lookup_tables.Settings, theta: np.ndarray, degree: int = 0) -> list[np.ndarray]:
    """Return for each lobe (T, H): weights of the rows of N in the scattering of light inclined by theta (T,).

    degree: of the Legendre polynomial of the sine of the other inclination, which weights the light.
    """
    rows = lookup_tables.row_cosines(settings)
    if settings.mode == "energy":
        # M is of unit area, whatever its width.
        means = _legendre_means(settings, theta, degree) if degree else np.ones((4, len(theta)))
        return [_interpolation(np.cos(theta)[:, None], rows, mean[:, None]) for mean in means]
    out = np.pi * ((np.arange(361) + 0.5) / 361 - 0.5)
    theta_h, theta_d = 0.5 * (theta[:, None] + out), 0.5 * (theta[:, None] - out)
    cosine = np.maximum(np.cos(theta_d), marschner.LEAST_COS_THETA_D)
    measure = np.square(np.cos(out) / cosine) * np.pi / 361 * legendre(np.sin(out), degree)
    m = marschner.gaussian_lobes(theta_h, settings)
    weights = [_interpolation(cosine, rows, m[..., lobe] * measure) for lobe in range(3)]
    return [*weights, np.zeros_like(weights[0])]


def legendre(x: Values, degree: int) -> np.ndarray:
    """Return the Legendre polynomial of a degree at x (...)."""
    return np.polynomial.legendre.legval(x, np.eye(degree + 1)[degree])


def _legendre_means(settings, theta, degree):
    """Return (4, T): the mean of `legendre` of sin(theta_i) over M of each lobe, for viewers at theta (T,)."""
    incoming = np.pi * ((np.arange(721) + 0.5) / 721 - 0.5)
    m = energy_conserving.m_lobes(incoming, theta[:, None], settings) * np.cos(incoming)[:, None]  # (T, 721, 4)
    # Narrow lobes are mirrors; adding a small mirror term avoids 0 / 0.
    mirrored = legendre(np.sin(-theta), degree)[:, None]
    total, least = m.sum(axis=1), 1e-6
    return ((np.einsum("tic,i->tc", m, legendre(np.sin(incoming), degree)) + least * mirrored) / (total + least)).T


def _interpolation(cosines, rows, weights):
    """Return the (T, H) matrix that sums values at rows (H,), interpolated to cosines (T, O), with weights (T, O)."""
    place = np.clip(np.interp(cosines, rows, np.arange(len(rows))), 0.0, len(rows) - 1.0)
    below = np.minimum(place.astype(int), len(rows) - 2)
    first = below + len(rows) * np.arange(len(cosines))[:, None]
    above = weights * (place - below)
    flat = np.bincount(first.ravel(), (weights - above).ravel(), len(cosines) * len(rows))
    flat += np.bincount(first.ravel() + 1, above.ravel(), len(flat))
    return flat.reshape(len(cosines), len(rows))


def _centres_and_widths(settings):
    """Return alpha and beta of the four lobes, (4,), in theta_h."""
    if settings.mode == "energy":
        shift, v = np.array(energy_conserving.lobes(settings)).T
        return 0.5 * shift, 0.5 * np.sqrt(v)
    alpha, beta = np.array(marschner.longitudinal_lobes(settings)).T
    return np.append(alpha, 0.0), np.append(beta, 0.0)


def _weighted(values, parts):
    """Return the mean (T, 3) of one value per lobe (4,), weighted by the scattering of each (4, T, 3)."""
    return np.einsum("p,ptc->tc", values, parts) / np.maximum(parts.sum(axis=0), 1e-12)


def back_scattering(
    a_f: Values, a_b: Values, alpha_f: Values, alpha_b: Values, beta_f: Values, beta_b: Values
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return (A_b, Delta_b, sigma_b) (...): light after one or three backward events and any number of forward events.

    The moments are summed exactly over the numbers of events; [Zinke08] expands them for small a_b.
    """
    x = np.square(a_f)
    once, thrice = a_b * x / (1.0 - x), np.power(a_b, 3) * x / np.power(1.0 - x, 3)
    # Mean numbers of forward events with one and with three backward events.
    events_once, events_thrice = 2.0 / (1.0 - x), 2.0 * (1.0 + 2.0 * x) / (1.0 - x)
    total = once + thrice
    shift = once * (alpha_b + events_once * alpha_f) + thrice * (3.0 * alpha_b + events_thrice * alpha_f)
    variance = once * (beta_b**2 + events_once * beta_f**2) + thrice * (3.0 * beta_b**2 + events_thrice * beta_f**2)
    least = np.maximum(total, 1e-30)
    return total, shift / least, np.sqrt(variance / least)


def back_azimuth(phi: Values) -> np.ndarray:
    """Return the fraction (...) of light from the half circle behind that goes to azimuth phi in the front half."""
    return 1.0 - np.abs(phi) / np.pi


def direct_part(count: Values) -> np.ndarray:
    """Return the unscattered fraction (...) of light behind `count` (...) strands on average, Poisson distributed."""
    return np.exp(-np.asarray(count, float))


def deep_hair(a_f: Values, a_b: Values) -> tuple[np.ndarray, np.ndarray]:
    """Return (attenuation per strand, reflectance) (...) of infinitely many strands: gamma and R of [Kubelka31]."""
    attenuation = np.sqrt(np.maximum(np.square(1.0 - a_f) - np.square(a_b), _LEAST_ATTENUATION**2))
    return attenuation, np.minimum(a_b / (1.0 - a_f + attenuation), _MOST_REFLECTANCE)


def layer_parts(count: Values, attenuation: np.ndarray, reflectance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the (transmitted, reflected) fractions (..., 3) of light for `count` (...) strands on average.

    attenuation, reflectance: from `deep_hair` (..., 3).
    """
    left = np.exp(-attenuation * np.asarray(count, float)[..., None])
    turned = np.square(reflectance)
    kept = 1.0 - turned * np.square(left)
    return (1.0 - turned) * left / kept, reflectance * (1.0 - np.square(left)) / kept


def fluxes(front: Values, behind: Values, a_f: np.ndarray, a_b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the (forward, backward) light (..., 3) at a strand; front, behind: mean numbers (...) of others.

    Both are fractions of the light at the first strand; no light comes from behind the last.
    """
    deep = deep_hair(a_f, a_b)
    transmitted, reflected = layer_parts(front, *deep)
    _through, returned = layer_parts(behind, *deep)
    onward = transmitted / (1.0 - reflected * returned)
    return onward, onward * returned


def mean_cosine(variance: Values) -> np.ndarray:
    """Return the factor (...) by which `d_eon_lobe` of a variance (...) reduces the mean sine of the inclination."""
    return 1.0 / np.tanh(1.0 / np.asarray(variance)) - variance


def variance_of(cosine: Values) -> np.ndarray:
    """Return the inverse (...) of `mean_cosine` (Banerjee et al. 2005); cosine: (...), 0 for uniform light."""
    m = np.clip(cosine, _LEAST_COSINE, 1.0)
    return (1.0 - m * m) / (m * (3.0 - m * m))


def drifts(
    front: Values, behind: Values, quantity: dict[str, np.ndarray]
) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """Return (shift, variance) (...) in theta_i + theta_o of light scattered forward in front, and from behind.

    Light from behind has one more event, in this strand. Each event multiplies the mean sine of the inclination by a
    mean cosine, so fluxes among strands that scatter only this fraction give the mean sine after any number of events,
    and thereby that number. Each event shifts light toward the same end of the strands. In deep hair the number of
    events has a geometric distribution, whose deviation equals its mean.
    """
    parts = np.stack([quantity["a_f"], quantity["a_b"]])
    # Means over the channels, which differ little.
    variances = np.stack([4.0 * np.square(quantity[name]).mean(axis=-1) for name in ("beta_f", "beta_b")])
    alpha = 2.0 * np.stack([quantity[name].mean(axis=-1) for name in ("alpha_f", "alpha_b")])
    cosines, weights = mean_cosine(variances), parts.sum(axis=-1)
    cosine, shift = ((weights * values).sum(axis=0) / weights.sum(axis=0) for values in (cosines, alpha))
    direct = direct_part(front)[..., None]
    onward, backward = fluxes(front, behind, *parts)
    kept, returned = fluxes(front, behind, *(parts * cosines[..., None]))

    def drift(kept, flux, last):
        left = last * (kept.sum(axis=-1) + _LEAST_FLUX) / (flux.sum(axis=-1) + _LEAST_FLUX)
        left = np.clip(left, _LEAST_COSINE, 1.0)
        turned = shift * np.log(left) / np.log(cosine)
        return turned, variance_of(left) + np.square(turned)

    return drift(kept - direct, onward - direct, 1.0), drift(returned, backward, cosine)


def sample_radiance(
    tables: lookup_tables.Tables,
    dual: DualTables,
    angles: FibreAngles,
    front: Values,
    behind: Values,
) -> np.ndarray:
    """Return radiance per irradiance (..., 3) of a strand; front, behind: mean numbers (...) of strands around it.

    For the energy-conserving mode, from tables, as the shader computes it.
    """
    settings = tables.settings
    if tables.n_res is None:
        raise ValueError("Dual scattering needs tables of the energy-conserving mode.")
    u, v = lookup_tables.n_coordinates(angles.phi, np.cos(angles.theta_o), settings.axes)
    n_res = lookup_tables.sample(tables.n_res, np.full_like(v, 0.5), v)
    n, n_trt, n_g, n_g_trt = (
        lookup_tables.sample(table, u, v) for table in (tables.n, tables.n_trt, dual.n_g, dual.n_g_trt)
    )
    quantity = {name: dual.at(name, angles.theta_i) for name in QUANTITIES}
    return radiance(angles, settings, quantity, (n, n_trt, n_res), (n_g, n_g_trt, n_res), front, behind)


def radiance(
    angles: FibreAngles,
    settings: lookup_tables.Settings,
    quantity: dict[str, np.ndarray],
    n: tuple[np.ndarray, ...],
    n_g: tuple[np.ndarray, ...],
    front: Values,
    behind: Values,
    *,
    roughness: Values | None = None,
) -> np.ndarray:
    """Return radiance per irradiance (..., 3) of a strand; front, behind: mean numbers (...) of strands around it.

    The irradiance is outside the hair. quantity: {name: (..., 3)} of the surrounding strands, at theta_i; n, n_g:
    arguments of `energy_conserving.lobe_sum` except M, for direct light and light scattered forward; roughness: (...)
    of varied strands. Widths and shifts are means over the channels.
    """
    onward, backward = fluxes(front, behind, quantity["a_f"], quantity["a_b"])
    direct = direct_part(front)[..., None]
    (shift, spread), (back_shift, back_spread) = drifts(front, behind, quantity)
    # A view rotated past the pole continues on the other side.
    views = (angles.theta_o, 0.0), (np.arcsin(np.sin(angles.theta_o - shift)), spread)
    m = [energy_conserving.m_lobes(angles.theta_i, view, settings, roughness, widening) for view, widening in views]
    # Light scattered backward is so wide that the lobes of this strand hardly matter.
    turned = angles.theta_o - back_shift
    sines = np.sin(angles.theta_i), np.cos(angles.theta_i), np.sin(turned), np.abs(np.cos(turned))
    m_back = d_eon_lobe(*sines, back_spread)
    ahead = back_azimuth(angles.phi)[..., None]
    returning = m_back[..., None] / np.pi * (quantity["a_f"] * ahead + quantity["a_b"] * (1.0 - ahead))
    return (
        direct * energy_conserving.lobe_sum(m[0], *n)
        + (onward - direct) * energy_conserving.lobe_sum(m[1], *n_g)
        + backward * returning
    )
