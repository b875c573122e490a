# SPDX-License-Identifier: GPL-3.0-or-later
"""Counts of strands to each side against what was put there."""

import numpy as np
import pytest

from hair_addon.core.hair_volume import SIDES, SOLID, measure

NO_SURFACE = np.empty((0, 3))


def cloud(rng, strand_count, radius):
    """Short strands anywhere in a unit cube, in any direction: (S, 2, 3) points, (S, 2) radii."""
    middles = rng.random((strand_count, 3))
    directions = rng.normal(size=(strand_count, 3))
    directions *= 0.005 / np.linalg.norm(directions, axis=1, keepdims=True)
    return np.stack([middles - directions, middles + directions], axis=1), np.full((strand_count, 2), radius)


@pytest.mark.parametrize("side", range(6))
def test_a_cloud_counts_what_rays_through_it_meet(rng, side):
    """Brute force: rays through a cloud of isotropic strands cross as many as their shadows say."""
    points, radii = cloud(rng, 4000, 0.01)
    volume = measure(points, radii, NO_SURFACE, resolution=16)
    axis, towards = "xyz".index(SIDES[side][1]), 1 if SIDES[side][0] == "+" else -1
    across = [k for k in range(3) if k != axis]
    starts = 0.2 + 0.6 * rng.random((4000, 3))
    crossed = 0.0
    for start in starts:
        ahead = (points.mean(axis=1)[:, axis] - start[axis]) * towards > 0.0
        a, b = (points[ahead][:, end][:, across] - start[across] for end in (0, 1))
        along = np.clip(-np.einsum("ij,ij->i", a, b - a) / np.einsum("ij,ij->i", b - a, b - a), 0.0, 1.0)
        # Flat ends, as the segments' shadows have them.
        inside = (along > 0.0) & (along < 1.0)
        crossed += np.count_nonzero(inside & (np.linalg.norm(a + along[:, None] * (b - a), axis=1) < 0.01))
    cells = ((starts - volume.low) / (volume.high - volume.low) * volume.counts.shape[2::-1]).astype(int)
    found = volume.counts[cells[:, 2], cells[:, 1], cells[:, 0], side].mean()
    assert found == pytest.approx(crossed / 4000, rel=0.09)


def test_both_sides_together_hold_the_whole_way(rng):
    points, radii = cloud(rng, 2000, 0.01)
    counts = measure(points, radii, NO_SURFACE, resolution=12).counts
    for axis, pair in ((2, (0, 1)), (1, (2, 3)), (0, (4, 5))):
        whole = counts[..., pair[0]] + counts[..., pair[1]]
        np.testing.assert_allclose(
            whole, np.broadcast_to(whole.take([0], axis=axis), whole.shape), rtol=1e-4, atol=1e-5
        )


def test_nothing_comes_through_a_surface(rng):
    points, radii = cloud(rng, 500, 0.001)
    wall = np.concatenate([rng.random((20000, 2)), np.full((20000, 1), 0.5)], axis=1)
    counts = measure(points, radii, wall, resolution=10).counts
    below, above = counts[:4, ..., SIDES.index("+z")], counts[6:, ..., SIDES.index("+z")]
    assert (below >= SOLID).all() and (above < 1.0).all()


def test_a_strand_without_extent_is_no_error():
    points = np.zeros((1, 2, 3))
    assert np.isfinite(measure(points, np.ones((1, 2)), NO_SURFACE).counts).all()
