# SPDX-License-Identifier: GPL-3.0-or-later
"""Light among parallel strands agrees with random walks, by events alone and by the fiber's own scattering."""

import numpy as np
import pytest

from hair_addon.core.shading.fibre import energy_conserving
from hair_addon.core.shading.fibre.angles import FibreAngles
from hair_addon.core.shading.tables import dual_scattering, lookup_tables


@pytest.mark.parametrize(("front", "behind"), [(1.5, 6.0), (4.0, 1.0)])
def test_drift_follows_the_number_of_events(rng, front, behind):
    """Drift follows the number of events where light, which continues or turns at each strand, crosses a depth."""
    a_f, a_b, cosine, shift = 0.72, 0.22, 0.96, 0.02
    count = 200_000
    depth, way, events = np.zeros(count), np.ones(count), np.zeros(count)
    crossed = {1.0: [], -1.0: []}
    while len(depth):
        reached = depth + way * rng.exponential(size=len(depth))
        for side, found in crossed.items():
            found.append(events[(way == side) & ((depth < front) != (reached < front))])
        chance = rng.random(len(depth))
        stays = (reached > 0.0) & (reached < front + behind) & (chance < a_f + a_b)
        depth, way = reached[stays], np.where(chance < a_f, way, -way)[stays]
        events = events[stays] + 1.0
    variance = float(dual_scattering.variance_of(cosine))
    names = {"a_f": a_f, "a_b": a_b, "alpha_f": 0.5 * shift, "alpha_b": 0.5 * shift}
    names |= {"beta_f": 0.5 * np.sqrt(variance), "beta_b": 0.5 * np.sqrt(variance)}
    quantity = {name: np.full(3, value) for name, value in names.items()}
    found = dual_scattering.drifts(front, behind, quantity)
    scattered = [events[events > 0.0] for events in map(np.concatenate, (crossed[1.0], crossed[-1.0]))]
    for (turned, spread), events in zip(found, (scattered[0], scattered[1] + 1.0), strict=True):
        assert turned == pytest.approx(shift * events.mean(), rel=0.1)
        kept = dual_scattering.mean_cosine(spread - turned**2)
        assert kept == pytest.approx((cosine**events).mean(), rel=0.02)


def test_white_fur_sends_light_back_off_the_mirror_cone(rng):
    """White fur upright on a black surface, 5 strands deep for level light, reflects light off the mirror cone.

    Light comes from 23° above the level and is seen from 41°: none of it is on the cone of one scattering event.
    """
    settings = lookup_tables.Settings(
        mode="energy", sigma_a=(0.005,) * 3, roughness=0.2, radial_roughness=0.3, tilt=np.radians(2.0)
    )
    tables = lookup_tables.bake(settings)
    view, light = np.radians(41.0), np.radians(23.0)
    expected = walked(rng, settings, view, light, depth=5.0)
    above = 5.0 * (np.arange(200) + 0.5) / 200
    seen = np.exp(-above / np.tan(view))
    at = FibreAngles(np.full(200, light), np.full(200, view), np.zeros(200))
    front, behind = above / np.tan(light), (5.0 - above) / np.tan(light)
    found = dual_scattering.sample_radiance(tables, dual_scattering.bake(tables), at, front, behind)[:, 0]
    assert np.average(found, weights=seen) == pytest.approx(expected, rel=0.3)


def walked(rng, settings, view, light, depth, count=8000, most_events=120, blur=0.02):
    """Return the mean radiance of fur, seen from the azimuth of its light, by paths from the viewer.

    blur: variance of the direction of the light [rad²].
    """
    cosines, phi = np.linspace(0.02, 1.0, 33), np.pi * (np.arange(180) + 0.5) / 180
    n = energy_conserving.n_lobes(phi, cosines[:, None], settings)[..., 0]  # (33, 180, 4)
    below = np.cumsum(n, axis=1) / n.sum(axis=1, keepdims=True)
    albedos = 2.0 * n.sum(axis=1) * np.pi / 180
    shifts, variances = (np.array(values, float) for values in zip(*energy_conserving.lobes(settings), strict=True))
    theta, azimuth, weight = np.full(count, view), np.zeros(count), np.ones(count)
    height = -rng.exponential(size=count) * np.tan(view)
    hits = (height > -depth).sum()
    total = 0.0
    for _event in range(most_events):
        inside = (height < 0.0) & (height > -depth) & (weight > 0.01)
        theta, azimuth, weight, height = (values[inside] for values in (theta, azimuth, weight, height))
        if not len(theta):
            break
        row = np.rint((np.cos(theta) - 0.02) / 0.98 * 32).clip(0, 32).astype(int)
        column = np.minimum(np.abs((azimuth + np.pi) % (2.0 * np.pi) - np.pi) / np.pi * 180, 179).astype(int)
        m = energy_conserving.m_lobes(np.full(len(theta), light), theta, settings, None, blur)
        total += (weight * (m * n[row, column]).sum(axis=-1) * np.exp(height / np.tan(light))).sum()
        parts = np.cumsum(albedos[row], axis=1)
        weight = weight * parts[:, -1]
        lobe = (rng.random(len(theta)) * parts[:, -1] > parts.T).sum(axis=0).clip(0, 3)
        cell = (rng.random(len(theta))[:, None] > below[row, :, lobe]).sum(axis=1).clip(0, 179)
        turned = (cell + rng.random(len(theta))) / 180 * np.pi * rng.choice([-1.0, 1.0], len(theta))
        # Around the mirror cone: M is the density of inclinations of a von Mises-Fisher distribution.
        v = variances[lobe]
        along = 1.0 + v * np.log(rng.uniform(1e-9, 1.0, len(theta)) * (1.0 - np.exp(-2.0 / v)) + np.exp(-2.0 / v))
        across = np.sqrt(np.maximum(1.0 - along**2, 0.0)) * np.cos(2.0 * np.pi * rng.random(len(theta)))
        mirrored = shifts[lobe] - theta
        sine = np.clip(np.sin(mirrored) * along + np.cos(mirrored) * across, -1.0, 1.0)
        height = height + rng.exponential(size=len(theta)) * sine / np.sqrt(np.maximum(1.0 - sine**2, 1e-12))
        theta, azimuth = -np.arcsin(sine), azimuth + turned + np.pi
    return total / hits
