# SPDX-License-Identifier: GPL-3.0-or-later
"""More paths start where hair is bright, and all means stay the same."""

from dataclasses import replace

import numpy as np
import pytest
import warp as wp

from hair_addon.core.shading.light_paths import gather, seen_rays, start_density
from tests.core.shading.light_paths.test_gather import ALONG_Y, grid_of, strands_in_a_box, sun, surroundings


def levels_of(light, even):
    """Return the densities of voxels whose sums are RGB drawn light and light in uniform light (Z, Y, X)."""
    sums = np.concatenate([np.zeros((*light.shape, 6)), *(np.stack([one] * 3, axis=-1) for one in (light, even))], -1)
    levels = wp.full(light.shape, int(start_density.EVEN), dtype=wp.uint8, device="cpu")
    start_density.set_levels(levels, [wp.array(sums, dtype=wp.float64, device="cpu")])
    return 2.0 ** ((levels.numpy() - float(start_density.EVEN)) / 4.0)


def test_the_density_is_that_of_drawn_light_and_one_in_the_mean(rng):
    even = np.ones((8, 8, 8))
    light = even.copy()
    light[:4] = 2.0
    found = levels_of(light, even)
    np.testing.assert_allclose(found[:4] / found[4:], 2.0, rtol=1e-6)
    np.testing.assert_allclose(found.mean(), 1.0, rtol=0.1)  # levels are rounded
    np.testing.assert_array_equal(levels_of(0.0 * light, even), 1.0)  # nothing is drawn
    np.testing.assert_array_equal(levels_of(light, 0.0 * even), 1.0)  # black in uniform light
    light[:4] = np.inf
    np.testing.assert_array_equal(levels_of(light, even), 1.0)


@pytest.fixture
def starts(monkeypatch):
    """Heights of the starts of each pass of paths."""
    traced, heights = gather._traced, []

    def keeping(*args):
        found = traced(*args)
        heights.append(found[0].numpy()[:, 2])
        return found

    monkeypatch.setattr(gather, "_traced", keeping)
    return heights


def test_hair_that_is_drawn_bright_has_more_paths_and_the_same_light(rng, starts):
    """Paths of a half that is drawn bright have less weight. If their light is not, further paths have even density."""
    grid = grid_of(strands_in_a_box(rng), (0.1, 0.3, 1.0), voxel_count=2_500)
    light = surroundings(lamps=sun((0.0, 1.0, 0.0)), world=0.2)
    seen = seen_rays.seen_by(grid, light.corners, ALONG_Y, 20_000)
    drawn = np.where(seen.places.numpy()[:, 2:] > 0.1, 10.0, 1.0) * np.ones(3, np.float32)
    totals = []
    for given in (seen, replace(seen, drawn=wp.array(drawn, dtype=wp.vec3, device="cpu"))):
        sums = gather.PathSums(grid, light)
        sums.see(given)
        sums.follow(8_000, 0)
        layers = sums.of_systems()[0].numpy()[..., :6].sum(axis=(1, 2))
        is_high = grid.corner[2] + grid.voxel * (np.arange(len(layers)) + 0.5) > 0.1
        totals.append([layers[is_high].sum(axis=0), layers[~is_high].sum(axis=0)])
        sums.follow(2_000, 1)
    first, second, first_drawn, second_drawn = starts
    assert (first_drawn > 0.1).mean() > 1.5 * (first > 0.1).mean()
    np.testing.assert_allclose(totals[1], totals[0], rtol=0.08)
    np.testing.assert_array_equal(second_drawn, second)
