# SPDX-License-Identifier: GPL-3.0-or-later
"""The world in path tracing: directions sampled in proportion to its light, without noise from small bright spots."""

from dataclasses import replace

import numpy as np
import warp as wp

from hair_addon.core.shading.light_paths import gather, seen_rays, world_light
from tests.core.shading.light_paths.test_gather import (
    ALONG_Y,
    found_by,
    gathered,
    grid_of,
    ratio,
    strands_in_a_box,
    surroundings,
)

wp.set_module_options({"enable_backward": False})


@wp.kernel
def _directions(
    world: world_light.World,
    out_directions: wp.array[wp.vec3],
    out_radiance: wp.array[wp.vec3],
    out_density: wp.array2d[float],
):
    path = wp.tid()
    direction, radiance, density, _state = world_light.world_direction(world, wp.rand_init(3, path))
    out_directions[path] = direction
    out_radiance[path] = radiance - world_light.world_radiance(world, direction)
    out_density[path, 0] = density
    out_density[path, 1] = world_light.world_density(world, direction)


def test_directions_are_as_dense_as_light(rng):
    """Directions are as dense as light: each hemisphere along three axes gets its share of the world's power."""
    picture = rng.exponential(size=(12, 24, 3)) ** 3
    with wp.ScopedDevice("cpu"):
        world = world_light.world_of(picture)
    directions, misses = (wp.zeros(200_000, dtype=wp.vec3, device="cpu") for _ in range(2))
    densities = wp.zeros((200_000, 2), dtype=float, device="cpu")
    wp.launch(_directions, 200_000, [world, directions, misses, densities], device="cpu")
    directions, densities = directions.numpy(), densities.numpy()
    assert np.linalg.norm(misses.numpy(), axis=1).astype(bool).mean() < 1e-3  # on texels' borders, by rounding
    np.testing.assert_allclose(np.median(densities[:, 0] / densities[:, 1]), 1.0)
    edges = np.sin(np.pi * (np.arange(13) / 12 - 0.5))
    powers = picture.sum(axis=-1) * np.diff(edges)[:, None]
    expected = np.array([powers[6:].sum(), powers[:, 6:18].sum(), powers[:, :12].sum()]) / powers.sum()
    found = (directions[:, 2] > 0).mean(), (directions[:, 0] > 0).mean(), (directions[:, 1] > 0).mean()
    np.testing.assert_allclose(found, expected, atol=0.005)


def test_directions_and_paths_that_meet_the_sky_find_the_same_light(rng, monkeypatch):
    """Sampled directions and paths that reach the sky find the same light, for hair on a floor under an uneven sky."""
    grid = grid_of(strands_in_a_box(rng, 600), (0.05, 0.3, 1.0), 0.01, voxel_count=625)
    picture = 0.1 + 4.0 * (rng.random((8, 16, 1)) < 0.15) * np.ones(3)
    floor = [(-3, -3, -0.6), (3, -3, -0.6), (0, 5, -0.6)]
    light = replace(surroundings(floor, [(0.6, 0.6, 0.6)]), world=picture)
    light = replace(light, gloss=np.array([[0.4, 0.0, 0.06]]))
    seen = seen_rays.seen_by(grid, light.corners, ALONG_Y, 10_000)
    monkeypatch.setattr(gather, "_KNOWN", 1e-6)
    count = len(seen.segments)
    by_both, _taken = gathered(grid, light, seen, count, most_paths=8 * count)
    monkeypatch.setattr(world_light, "_UNEVEN", np.inf)
    hit, _taken = gathered(grid, light, seen, count, most_paths=8 * count)
    np.testing.assert_allclose(ratio(by_both), ratio(hit), rtol=0.05)


def test_a_small_bright_place_is_found_by_few_paths(rng):
    grid = grid_of(strands_in_a_box(rng, 600), (0.05, 0.3, 1.0), 0.01, voxel_count=625)
    picture = np.full((64, 128, 3), 0.01)
    picture[40:42, 30:32] = 2_000.0
    light = replace(surroundings(), world=picture)
    means = [ratio(found_by(grid, light, ALONG_Y, 2_000, seed)).mean() for seed in range(6)]
    assert np.std(means) < 0.25 * np.mean(means)
