# SPDX-License-Identifier: GPL-3.0-or-later
"""Sums by voxel equal NumPy's, with the same bits in any order of additions on a GPU."""

import numpy as np
import pytest
import warp as wp

from hair_addon.core.errors import HairError
from hair_addon.core.shading.fibre import strand_variation
from hair_addon.core.shading.light_paths import media, row_sums, start_places, strand_grid, voxel_means, voxel_sums
from hair_addon.core.shading.tables import lookup_tables
from tests.core.shading.light_paths.test_gather import WHITE, grid_of, strands_in_a_box


@pytest.fixture(autouse=True)
def on_the_processor():
    """Create the compared arrays on the processor, also on a computer with CUDA."""
    with wp.ScopedDevice("cpu"):
        yield


def two_systems(rng, kinds=(None, None)):
    """Return a grid of two hairs of 60 and 90 strands."""
    settings = lookup_tables.Settings(mode="energy")
    systems = [
        strand_grid.Strands(
            strands_in_a_box(rng, count).astype(np.float32),
            np.full((count, 4), 0.004, np.float32),
            lambda _chosen: np.zeros((1, 2, 3)),
            np.zeros(4),
            np.full(count, 0.3),
            np.zeros(count, int),
            kind=kind,
        )
        for count, kind in zip((60, 90), kinds, strict=True)
    ]
    return strand_grid.build(systems, [settings], voxel_count=300)


def samples_of(rng, grid, count):
    segments = rng.integers(0, len(grid.points) - 1, count).astype(np.int32)
    places = grid.points.numpy()[segments] + rng.normal(0.0, 0.1, (count, 3)).astype(np.float32)  # some are outside
    return segments, places, *rng.exponential(size=(2, count, 3)).astype(np.float32)


def added(grid, segments, places, first, second, channel):
    found = voxel_sums.VoxelSums(grid)
    given = [media.vectors(values) for values in (places, first, second)]
    found.add(given[0], wp.array(segments, dtype=int, device="cpu"), *given[1:], channel)
    return np.stack([sums.numpy() for sums in found.of_systems()])


@pytest.mark.parametrize("way", ["_in_order", "_in_any_order"])
def test_values_are_added_to_their_hair_and_voxel(rng, monkeypatch, way):
    monkeypatch.setattr(row_sums, "_in_order", getattr(row_sums, way))
    grid = two_systems(rng)
    segments, places, first, second = samples_of(rng, grid, 5000)
    sums = added(grid, segments, places, first, second, 6)
    x, y, z = np.clip(np.floor((places - grid.corner) / grid.voxel), 0, np.array(grid.shape) - 1).astype(int).T
    expected = np.zeros((2, *grid.shape[::-1], 12))
    system = (grid.strands.numpy()[segments] >= 60).astype(int)
    np.add.at(expected, (system, z, y, x), np.concatenate([np.zeros((5000, 6)), first, second], axis=1))
    np.testing.assert_allclose(sums, expected, rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(sums.sum(axis=(0, 1, 2, 3))[6:9], first.sum(axis=0, dtype=float), rtol=1e-10)
    assert voxel_sums.brightness(media.vectors(first)) == pytest.approx(
        (first.sum(dtype=float), (first.sum(axis=1, dtype=float) ** 2).sum()), rel=1e-10
    )
    order = rng.permutation(5000)
    turned = added(grid, segments[order], places[order], first[order], second[order], 6)
    if way == "_in_any_order":
        np.testing.assert_array_equal(turned, sums)
    else:
        np.testing.assert_allclose(turned, sums, rtol=1e-12)


def test_linked_hair_has_common_sums(rng):
    """The sums of two hair systems of the same kind are the sums of each, added."""
    state = rng.bit_generator.state
    grid = two_systems(rng)
    rng.bit_generator.state = state
    linked = two_systems(rng, ("one", "one"))
    given = samples_of(rng, grid, 2000)
    apart, together = added(grid, *given, 6), added(linked, *given, 6)
    assert apart.any(axis=(1, 2, 3, 4)).all()
    np.testing.assert_allclose(together, np.repeat(apart.sum(axis=0, keepdims=True), 2, axis=0), rtol=1e-10)
    assert len({id(sums) for sums in voxel_sums.VoxelSums(linked).of_systems()}) == 1


def test_other_counts_are_refused(rng):
    grid = two_systems(rng)
    segments, places, first, second = samples_of(rng, grid, 10)
    with pytest.raises(HairError, match="values by voxel"):
        added(grid, segments, places[:5], first, second, 0)


def test_voxels_in_sight_are_those_of_places_and_what_touches_them(rng):
    grid = two_systems(rng)
    medium = media.medium_of(grid, None, np.zeros((0, 3)), np.zeros((0, 3)))
    places = samples_of(rng, grid, 8)[1]
    at = np.clip(np.floor((places - grid.corner) / grid.voxel), 0, np.array(grid.shape) - 1)
    every = np.stack(np.meshgrid(*(np.arange(side) for side in grid.shape), indexing="ij"), axis=-1)
    expected = (np.abs(every[..., None, :] - at).max(axis=-1) <= 1).any(axis=-1)
    found = start_places.voxels_of(medium, media.vectors(places))[0].numpy()
    np.testing.assert_array_equal(found.astype(bool), expected.transpose(2, 1, 0))


def test_shares_of_whole_sums_are_those_of_one_voxel_without_a_grid(rng):
    """With very many paths each voxel's shares are its own ratios; with few, they are those of the sum."""
    sums = rng.uniform(0.5, 1.5, (3, 4, 5, 12))
    own, shared = (
        voxel_means.smooth_ratios(wp.array(sums, dtype=wp.float64, device="cpu"), count) for count in (10**15, 1e-9)
    )
    expected = np.concatenate([sums[..., :3] / sums[..., 3:6], sums[..., 6:9] / sums[..., 9:]], axis=-1)
    np.testing.assert_allclose(own, expected, rtol=1e-6)
    totals = sums.sum(axis=(0, 1, 2))
    every = np.concatenate([totals[:3] / totals[3:6], totals[6:9] / totals[9:]])
    np.testing.assert_allclose(shared[0, 0, 0], every, rtol=0.02)


def test_kept_points_are_in_the_world_with_the_absorption_of_their_places(rng):
    """The law holds for a turned system that keeps every second strand at twice the width."""
    count, variation = 40, strand_variation.Settings(pigment=(0.2, 0.4, 0.9), random_color=0.3, tip_absorption=2.0)
    randoms, points = rng.random(count), rng.normal(size=(count, 17, 3)).astype(np.float32)
    radii = rng.uniform(0.01, 0.02, (count, 17)).astype(np.float32)
    to_world = np.eye(4)
    to_world[:3] = rng.normal(size=(3, 4))
    strands = strand_grid.Strands(
        points,
        radii,
        lambda chosen: strand_variation.sigma_a_along(variation, randoms[chosen, None], np.array([0.0, 1.0])),
        strand_variation.tip_gradient(0.0, 1.0, np.linspace(0.0, 1.0, 17)),
        rng.random(count),
        np.zeros(count, int),
        to_world,
    )
    grid = strand_grid.build([strands], [lookup_tables.Settings(mode="energy")], segment_count=4 * count)
    (system,) = grid.thinned
    assert (system.stride, system.point_count) == (2, 9)
    chosen, at = np.arange(0, count, 2), np.arange(0, 17, 2)
    world = points[chosen][:, at] @ to_world[:3, :3].T + to_world[:3, 3]
    np.testing.assert_allclose(grid.points.numpy(), world.reshape(-1, 3), atol=2e-6)
    np.testing.assert_allclose(grid.radii.numpy(), 2.0 * radii[chosen][:, at].ravel(), rtol=1e-6)
    sigma_a = strand_variation.strand_sigma_a(variation, randoms[chosen, None], at / 16)
    np.testing.assert_allclose(grid.sigma_a.numpy(), sigma_a.reshape(-1, 3), rtol=2e-6)
    np.testing.assert_array_equal(grid.strands.numpy(), np.repeat(np.arange(20), 9))
    np.testing.assert_array_equal(grid.roughness.numpy(), strands.roughness[chosen].astype(np.float32))


def test_white_hair_of_a_grid_has_a_voxel_for_every_place(rng):
    """White hair has a voxel for every place, as the corners of the grid are those of its hair with widths."""
    points = strands_in_a_box(rng, 50)
    grid = grid_of(points, WHITE, 0.01, voxel_count=100)
    high = grid.corner + grid.voxel * np.array(grid.shape)
    assert (grid.corner <= points.reshape(-1, 3).min(axis=0) - 0.01 + 1e-6).all()
    assert (high >= points.reshape(-1, 3).max(axis=0) + 0.01 - 1e-6).all()
    assert (high - grid.voxel <= points.reshape(-1, 3).max(axis=0) + 0.01 + 1e-6).all()
