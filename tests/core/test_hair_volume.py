# SPDX-License-Identifier: GPL-3.0-or-later
"""Counts of strands to each side against what was put there."""

import numpy as np
import pytest

from hair_addon.core.hair_volume import SIDES, SOLID, measure

NO_SURFACE = np.empty((0, 3))


def cloud(rng, strand_count, radius):
    """Short segments anywhere in a unit cube, in any direction: starts and ends (S, 3), widths (S,)."""
    middles = rng.random((strand_count, 3))
    directions = rng.normal(size=(strand_count, 3))
    directions *= 0.005 / np.linalg.norm(directions, axis=1, keepdims=True)
    return middles - directions, middles + directions, np.full(strand_count, 2.0 * radius)


@pytest.mark.parametrize("side", range(6))
def test_a_cloud_counts_what_rays_through_it_meet(rng, side):
    """Brute force: rays through a cloud of isotropic strands cross as many as their shadows say."""
    starts, ends, widths = cloud(rng, 4000, 0.01)
    volume = measure(starts, ends, widths, NO_SURFACE, resolution=16)
    axis, towards = "xyz".index(SIDES[side][1]), 1 if SIDES[side][0] == "+" else -1
    across = [k for k in range(3) if k != axis]
    origins = 0.2 + 0.6 * rng.random((4000, 3))
    crossed = 0.0
    for origin in origins:
        ahead = (0.5 * (starts + ends)[:, axis] - origin[axis]) * towards > 0.0
        a, b = (places[ahead][:, across] - origin[across] for places in (starts, ends))
        along = np.clip(-np.einsum("ij,ij->i", a, b - a) / np.einsum("ij,ij->i", b - a, b - a), 0.0, 1.0)
        # Flat ends, as the segments' shadows have them.
        inside = (along > 0.0) & (along < 1.0)
        crossed += np.count_nonzero(inside & (np.linalg.norm(a + along[:, None] * (b - a), axis=1) < 0.01))
    cells = ((origins - volume.low) / (volume.high - volume.low) * volume.counts.shape[2::-1]).astype(int)
    found = volume.counts[cells[:, 2], cells[:, 1], cells[:, 0], side].mean()
    assert found == pytest.approx(crossed / 4000, rel=0.09)


def test_both_sides_together_hold_the_whole_way(rng):
    counts = measure(*cloud(rng, 2000, 0.01), NO_SURFACE, resolution=12).counts
    for axis, pair in ((2, (0, 1)), (1, (2, 3)), (0, (4, 5))):
        whole = counts[..., pair[0]] + counts[..., pair[1]]
        np.testing.assert_allclose(
            whole, np.broadcast_to(whole.take([0], axis=axis), whole.shape), rtol=1e-4, atol=1e-5
        )


def test_nothing_comes_through_a_surface(rng):
    wall = np.concatenate([rng.random((20000, 2)), np.full((20000, 1), 0.5)], axis=1)
    counts = measure(*cloud(rng, 500, 0.001), wall, resolution=10).counts
    below, above = counts[:4, ..., SIDES.index("+z")], counts[6:, ..., SIDES.index("+z")]
    assert (below >= SOLID).all() and (above < 1.0).all()


def test_a_strand_without_extent_is_no_error():
    point = np.zeros((1, 3))
    assert np.isfinite(measure(point, point, np.ones(1), NO_SURFACE).counts).all()
