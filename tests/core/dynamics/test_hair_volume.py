# SPDX-License-Identifier: GPL-3.0-or-later
"""V20: friction conserves momentum and dissipates energy; the groom has no pressure; sums do not depend on order."""

import numpy as np
import pytest
import warp as wp

from hair_addon.core.dynamics.hair_volume import MOST_CELLS_ALONG, HairVolume
from hair_addon.core.errors import HairError

LANES = 8
STEP = 0.01  # [s]


def lay(strands, device):
    """Convert numbers (S, N, K) of points to lane groups (groups, N K, LANES)."""
    count = strands.shape[1] * strands.shape[2]
    groups = strands.reshape(-1, LANES, count).transpose(0, 2, 1)
    return wp.array(np.ascontiguousarray(groups, np.float32), dtype=float, device=device)


def taken(array, point_count):
    """Convert lane groups to (S, N, K) float64."""
    values = array.numpy().astype(np.float64)
    return values.transpose(0, 2, 1).reshape(-1, point_count, values.shape[1] // point_count)


class Hair:
    """Strands of equal points, of which each first one has no mass, so that all points that count may move."""

    def __init__(self, rng, device, strand_count=64, point_count=9, size=0.05):
        self.device, self.count = device, point_count
        self.points = rng.uniform(-size, size, (strand_count, point_count, 3)).astype(np.float32)
        self.velocities = rng.normal(0.0, 1.0, self.points.shape).astype(np.float32)
        self.masses = rng.uniform(0.5, 1.5, (strand_count, point_count, 1)).astype(np.float32)
        self.masses[:, 0] = 0.0

    def volume(self, regions=None, cell_size=0.01, groom=None, fitted=None):
        volume = HairVolume(lay(self.masses, self.device), regions, cell_size)
        groom, fitted = (self.points if given is None else given for given in (groom, fitted))
        volume.fit(lay(fitted, self.device), lay(groom, self.device))
        return volume

    def rubbed(self, volume, friction=30.0, pressure=0.0, wetness=0.0, points=None):
        """Return velocities after friction; wetness: of all strands, or (S,) of each."""
        velocities = lay(self.velocities, self.device)
        points = lay(self.points if points is None else points, self.device)
        wetness = np.broadcast_to(wetness, len(self.points))
        waters = lay(wetness[:, None, None], self.device) if wetness.any() else None
        volume.rub(points, velocities, STEP, friction, pressure, waters)
        return taken(velocities, self.count)

    def momentum(self, velocities):
        return (self.masses * velocities).sum(axis=(0, 1))

    def energy(self, velocities):
        return 0.5 * (self.masses * velocities**2).sum()


@pytest.fixture
def hair(rng, device):
    return Hair(rng, device)


@pytest.mark.gate(id="V20")
@pytest.mark.parametrize("friction", [0.5, 30.0, 1e6])
def test_friction_keeps_momentum_and_takes_energy(hair, friction):
    before = hair.velocities.astype(np.float64)
    after = hair.rubbed(hair.volume(), friction)
    moved = np.abs(hair.masses * before).sum()
    assert np.abs(hair.momentum(after) - hair.momentum(before)).max() < 2.0**-20 * moved
    assert hair.energy(after) < hair.energy(before)
    assert np.abs(after[:, 0] - before[:, 0]).max() == 0.0


def test_friction_leaves_what_moves_as_one(hair):
    """Friction leaves a translation unchanged and slows two streams that run against each other."""
    volume = hair.volume()
    hair.velocities[:] = [1.0, -2.0, 0.5]
    np.testing.assert_allclose(hair.rubbed(volume, 1e6), hair.velocities, atol=2e-5)
    hair.velocities[...] = 0.0
    hair.velocities[..., 0] = np.sign(hair.points[..., 1])
    assert (hair.rubbed(volume, 1e6) * hair.velocities)[:, 1:].sum() < (hair.velocities**2)[:, 1:].sum()
    assert np.array_equal(hair.rubbed(volume, 0.0), hair.velocities)


@pytest.mark.gate(id="V20")
def test_nothing_pushes_at_the_groom_and_what_is_pressed_spreads(hair):
    volume = hair.volume()
    np.testing.assert_array_equal(hair.rubbed(volume, 0.0, 0.5, 1.0), hair.velocities)
    pressed = hair.points * np.float32(0.5)
    hair.velocities[...] = 0.0
    pushed = hair.rubbed(hair.volume(fitted=pressed), 0.0, 1e-3, 0.0, pressed)
    outwards = np.einsum("spi,spi->sp", pushed, pressed)[:, 1:]
    assert outwards.mean() > 0.0 and (outwards > 0.0).mean() > 0.6
    twice = hair.rubbed(hair.volume(fitted=pressed), 0.0, 2e-3, 0.0, pressed)
    np.testing.assert_allclose(twice, 2.0 * pushed, atol=1e-5)
    strongest = hair.rubbed(hair.volume(fitted=pressed), 0.0, 1e9, 0.0, pressed)
    assert np.linalg.norm(strongest, axis=2).max() <= 0.5 * 0.01 / STEP * (1.0 + 1e-5)


def test_wet_hair_draws_together_where_it_has_thinned(hair):
    hair.velocities[...] = 0.0
    thinned = hair.points * np.float32(1.12)
    volume = hair.volume(fitted=thinned)
    dry, wet = (hair.rubbed(volume, 0.0, 0.5, wetness, thinned) for wetness in (0.0, 1.0))
    drawn = np.einsum("spi,spi->sp", wet - dry, thinned)[:, 1:]
    assert drawn.any() and drawn.mean() < 0.0


def test_cohesion_pulls_wet_strands_alone(rng, hair):
    thinned = hair.points * np.float32(1.12)
    volume = hair.volume(fitted=thinned)
    is_wet = rng.random(len(hair.points)) < 0.5
    some, none, all_of_them = (hair.rubbed(volume, 2.0, 0.5, wetness, thinned) for wetness in (is_wet, 0.0, 1.0))
    np.testing.assert_array_equal(some[is_wet], all_of_them[is_wet])
    np.testing.assert_array_equal(some[~is_wet], none[~is_wet])
    assert np.abs(all_of_them - none).max() > 1e-3


def test_sums_have_no_order(rng, hair, monkeypatch):
    """Sums do not depend on the order of strands and threads."""
    shuffled = Hair(rng, hair.device)
    order = rng.permutation(len(hair.points))
    for name in ("points", "velocities", "masses"):
        setattr(shuffled, name, getattr(hair, name)[order])
    pressed = hair.points * np.float32(0.7)
    one = hair.rubbed(hair.volume(fitted=pressed), 30.0, 0.5, 0.5, pressed)
    other = shuffled.rubbed(
        shuffled.volume(groom=hair.points[order], fitted=pressed[order]), 30.0, 0.5, 0.5, pressed[order]
    )
    np.testing.assert_array_equal(one[order], other)
    monkeypatch.setattr("hair_addon.core.dynamics.hair_volume._LEAST_ROWS", 64)
    monkeypatch.setattr("hair_addon.core.kernels.parallel._core_count", lambda device: 3 if device.is_cpu else 1)
    np.testing.assert_array_equal(one, hair.rubbed(hair.volume(fitted=pressed), 30.0, 0.5, 0.5, pressed))


@pytest.mark.gate(id="V20")
def test_regions_do_not_feel_each_other(rng, device):
    """Two regions in one place move as each would alone."""
    both = Hair(rng, device)
    regions = np.repeat(np.arange(8) % 2, LANES).reshape(8, LANES)
    pressed = both.points * np.float32(0.7)
    together = both.rubbed(both.volume(regions, fitted=pressed), 30.0, 0.5, 0.0, pressed)
    mixed = both.rubbed(both.volume(fitted=pressed), 30.0, 0.5, 0.0, pressed)
    assert np.abs(together - mixed).max() > 0.01
    for region in range(2):
        alone = Hair(rng, device)
        for name in ("points", "velocities", "masses"):
            setattr(alone, name, getattr(both, name).copy())
        alone.masses[regions.ravel() != region] = 0.0
        found = alone.rubbed(alone.volume(fitted=pressed), 30.0, 0.0, 0.0, pressed)
        wanted = both.rubbed(both.volume(regions, fitted=pressed), 30.0, 0.0, 0.0, pressed)
        np.testing.assert_array_equal(found[regions.ravel() == region], wanted[regions.ravel() == region])


def test_the_grid_is_no_larger_than_it_may_be(rng, device):
    for size, regions in ((0.02, None), (0.5, None), (30.0, None), (0.5, np.arange(64).reshape(8, 8))):
        hair = Hair(rng, device, size=size)
        volume = hair.volume(regions, cell_size=0.004)
        counts = np.array(volume.grid.counts)
        assert counts.max() <= MOST_CELLS_ALONG and len(volume._rest) <= 4 * MOST_CELLS_ALONG**3
        assert volume.cell_size >= 0.004 and volume.cell_size * counts.min() >= 1.9 * size
        # All of the mass is in it.
        assert abs(int(volume._rest.numpy().sum()) / 2**20 - hair.masses.sum()) < 1e-3


def test_points_that_are_no_numbers_or_have_left_are_left_alone(hair):
    bad = hair.points.copy()
    bad[3, 4], bad[5, 2], bad[7, 7] = np.nan, np.inf, 1e30
    hair.velocities[9, 3], hair.velocities[11, 5] = 1e30, np.nan
    gone = bad.copy()
    gone[20, 3] = 9.0
    volume = hair.volume(groom=hair.points, fitted=bad)
    after = hair.rubbed(volume, 30.0, 0.5, 0.0, gone)
    for place in ((3, 4), (5, 2), (7, 7), (9, 3), (11, 5), (20, 3)):
        np.testing.assert_array_equal(after[place], hair.velocities[place])
    rest = np.delete(after.reshape(-1, 3), [9 * s + p for s, p in ((9, 3), (11, 5))], axis=0)
    assert np.isfinite(rest).all() and np.abs(rest).max() < 10.0
    nowhere = np.full_like(hair.points, np.nan)
    lost = hair.volume(groom=nowhere, fitted=nowhere)
    np.testing.assert_array_equal(hair.rubbed(lost)[1], hair.velocities[1])


def test_what_does_not_fit_is_refused(hair, device):
    masses = lay(hair.masses, device)
    for regions, size in ((np.zeros((1, 8), int), 0.01), (np.full((8, 8), -1), 0.01), (None, 0.0), (None, np.nan)):
        with pytest.raises(HairError):
            HairVolume(masses, regions, size)
    with pytest.raises(HairError):
        HairVolume(masses, np.full((8, 8), 2**30), 0.01)
    with pytest.raises(HairError):
        hair.volume().rub(masses, masses, STEP, 1.0, 1.0)


@pytest.mark.parametrize("spacing", [0.002, 0.006, 0.013])
def test_a_straight_strand_alone_is_not_pushed(rng, device, spacing):
    """A straight strand alone is not pushed, at any place and direction in the grid, for any size of cells."""
    for _ in range(40):
        along = rng.normal(size=3)
        line = rng.uniform(0.0, 0.02, 3) + spacing * np.arange(12)[:, None] * along / np.linalg.norm(along)
        hair = Hair(rng, device, LANES, len(line))
        hair.points = np.repeat(line[None], LANES, axis=0).astype(np.float32)
        hair.masses[:], hair.masses[1:] = 1.0, 0.0  # the other lanes have no strand
        elsewhere = hair.points + np.float32(0.3)  # where the groom was
        after = hair.rubbed(hair.volume(groom=elsewhere), friction=0.0, pressure=50.0)
        np.testing.assert_array_equal(after[0], hair.velocities[0])
