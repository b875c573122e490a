# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables of varied strands: N for any absorption, and multiple scattering among all strands.

A strand scatters with its own absorption. The strands in front of it and behind it have any random numbers, but the
same position along the gradient from the root's color to the tip's. So dual scattering uses means over the random
numbers, at each position along the gradient.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..fibre import strand_variation
from ..fibre.angles import FibreAngles, Values
from ..fibre.principled import varied_roughness
from . import absorption_slices, albedo, dual_scattering, lookup_tables

GREATEST_SIZE = 128  # of slices: errors are below 0.3 % of a peak; see DECISIONS.md

_BLACK = 16.0  # sigma_a whose transmittance is below half floats; the upper limit of slices

_GRADIENT_STEPS = 9  # from the root's color to the tip's
_RANDOM_STEPS = 12  # number of random samples
_RETURN_STEPS = 32  # rows of `StrandTables.returned`


@dataclass(frozen=True, eq=False)
class StrandTables:
    """Tables of hair with the variation of `strand_variation.Settings`.

    dual: rows as in `dual_scattering.QUANTITIES`, means over strands; its slices run from the root's color (first) to
    the tip's (last). returned: `albedo.fibre_moments` as channels, over theta_o (columns) and sqrt(sigma_a) (rows, from
    one end of the slices' range to the other).
    """

    slices: absorption_slices.Slices
    variation: strand_variation.Settings
    dual: np.ndarray | None  # (G, 9, T, 3), of the energy-conserving mode
    returned: np.ndarray  # (32, T, 4)
    forward: np.ndarray  # (3,): fraction of uniform light scattered forward, the mean over all strands
    backward: np.ndarray  # (3,): fraction scattered backward

    @property
    def settings(self) -> lookup_tables.Settings:
        """The fiber's settings, without its absorption."""
        return self.slices.settings


def bake(settings: lookup_tables.Settings, variation: strand_variation.Settings, device: str = "cpu") -> StrandTables:
    """Bake `StrandTables`; sigma_a of the `lookup_tables.Settings` is not used."""
    settings = replace(settings, size=min(settings.size, GREATEST_SIZE))
    least, greatest = np.minimum(strand_variation.absorption_range(variation), _BLACK)
    slice_count = 2 if least == greatest else absorption_slices.SLICE_COUNT
    slices = absorption_slices.bake(settings, (least, greatest), slice_count, device)

    random = (np.arange(_RANDOM_STEPS) + 0.5) / _RANDOM_STEPS if variation.random_color > 0.0 else np.array([0.5])
    gradient = np.linspace(0.0, 1.0, _GRADIENT_STEPS if variation.has_gradient else 1)
    around = strand_variation.sigma_a_along(variation, random, gradient[:, None])  # (G, R, 3)
    dual = dual_among(slices, around) if settings.mode == "energy" else None
    weights = _part_of_length(variation, gradient)
    forward, backward = (
        np.einsum("grc,g->c", at_absorptions(part, slices, around), weights) / len(random)
        for part in albedo.mean_parts(slices.lobes, settings)  # (K,) each
    )
    return StrandTables(slices, variation, dual, returned(slices), forward, backward)


def dual_among(slices: absorption_slices.Slices, around: np.ndarray) -> np.ndarray:
    """Return `StrandTables.dual` among strands with sigma_a (G, R, 3)."""
    theta = dual_scattering.light_inclinations()
    parts = np.stack(dual_scattering.lobe_parts(slices.lobes, slices.settings, theta))  # (2, 4, T, K)
    means = at_absorptions(parts, slices, around).mean(axis=-2)  # (2, 4, T, G, 3)
    return np.stack(
        [dual_scattering.quantities(ahead, behind, slices.settings) for ahead, behind in means.transpose(3, 0, 1, 2, 4)]
    )


def returned(slices: absorption_slices.Slices) -> np.ndarray:
    """Return `StrandTables.returned`."""
    moments = albedo.fibre_moments(slices.lobes, slices.settings)  # (4, T, K)
    places = np.linspace(0.0, len(slices.n) - 1.0, _RETURN_STEPS)
    return np.ascontiguousarray(
        _smoothly_between(moments, places, slices.range.low == 0.0).transpose(2, 1, 0), np.float32
    )


def _smoothly_between(values, places, is_even):
    """Return values (..., N) at places (M,) from 0 to N - 1 along the last axis, by cubics with the slopes of
    parabolas.

    is_even: whether values are even functions about the first place, as functions of sigma_a are even in sqrt(sigma_a).
    Moments are smooth in sqrt(sigma_a), in which slices are evenly spaced; linear interpolation would be off by
    1.5/255.
    """
    slopes = np.gradient(values, axis=-1, edge_order=2 if values.shape[-1] > 2 else 1)
    if is_even:
        slopes[..., 0] = 0.0
    below = np.minimum(places.astype(int), values.shape[-1] - 2)
    x = places - below
    ends, slopes = (np.stack([each[..., below], each[..., below + 1]]) for each in (values, slopes))
    from_first = (1.0 + 2.0 * x) * (1.0 - x) ** 2 * ends[0] + x * (1.0 - x) ** 2 * slopes[0]
    return from_first + x**2 * ((3.0 - 2.0 * x) * ends[1] - (1.0 - x) * slopes[1])


def at_absorptions(values: np.ndarray, slices: absorption_slices.Slices, sigma_a: np.ndarray) -> np.ndarray:
    """Return values (..., K) of the slices interpolated to sigma_a (...), whose axes are appended."""
    below, fraction = absorption_slices.slice_of(sigma_a, slices.range.low, slices.range.high, len(slices.n))
    return absorption_slices.geometric_mix(values[..., below], values[..., below + 1], fraction)


def _part_of_length(variation, gradient):
    """Return the fraction (G,) of the strands' length that each step of the gradient represents; the sum is 1."""
    if len(gradient) == 1:
        return np.ones(1)
    positions = (np.arange(256) + 0.5) / 256
    reached = strand_variation.tip_gradient(variation.gradient_start, variation.gradient_end, positions)
    place = reached * (len(gradient) - 1)
    return np.maximum(0.0, 1.0 - np.abs(place - np.arange(len(gradient))[:, None])).mean(axis=1)


def hair_return(
    tables: StrandTables, theta_o: Values, random: Values, position: Values
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return `albedo.azimuthal_moments`, (..., 3) each, of strands viewed from theta_o (...), like the shader."""
    variation, covered = tables.variation, tables.slices.range
    roots = np.sqrt(strand_variation.strand_sigma_a(variation, random, position))
    along = np.clip((roots - covered.low) / max(covered.high - covered.low, 1e-6), 0.0, 1.0)
    v = (along * (_RETURN_STEPS - 1) + 0.5) / _RETURN_STEPS
    u = np.broadcast_to((np.asarray(theta_o) / np.pi + 0.5)[..., None], v.shape)
    returned, towards, zonal_1, zonal_2 = np.moveaxis(lookup_tables.sample(tables.returned, u, v), -1, 0)
    return returned, towards, zonal_1, zonal_2


def sample_radiance(
    tables: StrandTables,
    angles: FibreAngles,
    random: Values,
    position: Values,
    front: Values,
    behind: Values,
) -> np.ndarray:
    """Return radiance per irradiance (..., 3) at `FibreAngles` (...) of strands.

    random, position (...): of the strands; front, behind: mean numbers (...) of strands in front and behind. For the
    energy-conserving mode, from tables, as the shader computes it.
    """
    settings, variation, slices = tables.settings, tables.variation, tables.slices
    if slices.n_g is None:
        raise ValueError("Dual scattering needs tables of the energy-conserving mode.")
    sigma_a = strand_variation.strand_sigma_a(variation, random, position)
    roughness = varied_roughness(settings.roughness, variation.random_roughness, random)
    at = lookup_tables.n_coordinates(angles.phi, np.cos(angles.theta_o), settings.axes)
    n, n_g = (absorption_slices.sample_lobes(texels, slices.range, *at, sigma_a) for texels in (slices.n, slices.n_g))
    gradient = strand_variation.tip_gradient(variation.gradient_start, variation.gradient_end, position)
    quantity = {name: _quantity(tables, name, angles.theta_i, gradient) for name in dual_scattering.QUANTITIES}
    return dual_scattering.radiance(angles, settings, quantity, n, n_g, front, behind, roughness=roughness)


def _quantity(tables, name, theta, gradient):
    """Return a quantity (..., 3) of the surrounding strands, at inclinations and positions along the gradient (...)."""
    table = tables.dual[:, dual_scattering.QUANTITIES.index(name)]  # (G, T, 3)
    step_count = len(table)
    v = (gradient * (step_count - 1) + 0.5) / step_count
    return lookup_tables.sample(table, np.asarray(theta) / np.pi + 0.5, v)
