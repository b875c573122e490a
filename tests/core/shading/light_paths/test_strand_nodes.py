# SPDX-License-Identifier: GPL-3.0-or-later
"""Sample points along strands keep the difference between neighboring strands, and the mean of paths' light."""

from dataclasses import replace

import numpy as np
import pytest
import warp as wp

from hair_addon.core.shading.light_paths import (
    gather,
    light_texels,
    media,
    row_sums,
    seen_rays,
    strand_nodes,
    voxel_means,
)
from tests.core.shading.light_paths.test_gather import (
    ALONG_Y,
    WHITE,
    grid_of,
    strands_in_a_box,
    sun,
    surroundings,
)
from tests.core.shading.light_paths.test_voxel_sums import two_systems


@pytest.fixture(autouse=True)
def on_the_processor():
    """Create the compared arrays on the processor, also on a computer with CUDA."""
    with wp.ScopedDevice("cpu"):
        yield


def ratios_of(grid, at_once, later, world):
    """Return constant ratios of all voxels, as `NodeSums.texels` takes them."""
    values = np.concatenate([np.full(3, at_once), np.full(3, later), np.full(3, world)])
    return wp.array(np.broadcast_to(values, (*grid.shape[::-1], 9)), dtype=wp.float64), (0, 0, 0)


@pytest.mark.parametrize("way", ["_in_order", "_in_any_order"])
def test_light_is_added_to_the_nearest_node_of_its_strand(rng, monkeypatch, way):
    monkeypatch.setattr(row_sums, "_in_order", getattr(row_sums, way))
    grid = two_systems(rng)
    nodes = strand_nodes.NodeSums(grid)
    points = grid.points.numpy().reshape(-1, 4, 3)
    strand, segment, part = rng.integers(0, 150, 4000), rng.integers(0, 3, 4000), rng.random(4000).astype(np.float32)
    places = points[strand, segment] + part[:, None] * (points[strand, segment + 1] - points[strand, segment])
    light, even = rng.exponential(size=(2, 4000, 3)).astype(np.float32)
    given = [media.vectors(values) for values in (places, light, even)]
    nodes.add(wp.array((4 * strand + segment).astype(np.int32), dtype=int), *given)
    ratios = ratios_of(grid, 1.0, 0.0, 0.0)
    for system, (first, last) in enumerate(((0, 60), (60, 150))):
        texels = nodes.texels(system, *ratios)
        count = texels.shape[1]
        inside = (strand >= first) & (strand < last)
        at = np.clip(((segment + part) / 3.0 * count).astype(int), 0, count - 1)
        rows = (strand[inside] - first, at[inside])
        sums = np.zeros((2, last - first, count, 3))
        np.add.at(sums[0], rows, light[inside])
        np.add.at(sums[1], rows, even[inside])
        prior = strand_nodes._PRIOR * even.sum(dtype=float) / len(even)
        known = sums[1].sum(axis=-1) / (sums[1].sum(axis=-1) + prior)
        is_used = known > 0.0
        expected = (known[..., None] * sums[0] / np.maximum(sums[1], 1e-12))[is_used]
        # Rounding decides the node of few places in the middle between two.
        same = np.isclose(texels[is_used][:, :3], expected, rtol=1e-3).all(axis=-1)
        assert same.mean() > 0.99
        np.testing.assert_allclose(texels[is_used][same][:, 3], 1.0 - known[is_used][same], atol=1e-4)
        assert (texels[~is_used] == np.array([0.0, 0.0, 0.0, 1.0])).all()


def test_strands_of_a_voxel_keep_their_light(rng):
    """In a voxel with lit and dark strands, nodes have the light of each strand, and their mean is the voxel's."""
    grid = two_systems(rng)
    nodes = strand_nodes.NodeSums(grid)
    segments = np.repeat(np.arange(0, 240, 4), 500).astype(np.int32)  # the first of each strand of the first hair
    places = grid.points.numpy()[segments]
    light = np.where(segments[:, None] % 8 == 0, 2.0, 0.0) * np.ones(3)
    given = [media.vectors(values.astype(np.float32)) for values in (places, light, np.ones_like(light))]
    nodes.add(wp.array(segments, dtype=int), *given)
    of_voxels = np.array([0.9, 0.9, 0.9, 0.1])  # a tenth of drawn light, which is 1 here
    texels = nodes.texels(0, *ratios_of(grid, 1.0, 0.0, 0.0))[:, 0]
    shown = texels[:, :3] + texels[:, 3:] * (of_voxels[:3] + of_voxels[3])
    np.testing.assert_allclose(shown[::2], 2.0, rtol=0.02)
    np.testing.assert_allclose(shown[1::2], 0.0, atol=0.03)
    np.testing.assert_allclose(shown.mean(), 1.0, rtol=1e-3)
    later = nodes.texels(0, *ratios_of(grid, 1.0, 0.5, 0.0))[:, 0]
    np.testing.assert_allclose(later[:, :3] - texels[:, :3], 0.5 * (1.0 - texels[:, 3:]) * np.ones(3), rtol=1e-5)


def test_light_of_an_even_world_stays_in_voxels(rng):
    """Without lamps, all light comes from voxels: two parts of it with separate noise would differ by more."""
    grid = grid_of(strands_in_a_box(rng, 200), WHITE, voxel_count=300)
    light = surroundings(world=0.7)
    seen = seen_rays.seen_by(grid, light.corners, ALONG_Y, 2000)
    sums = gather.gather(grid, light, seen, 3000)
    (texels,) = sums.texels()
    layers = light_texels.sides_of(grid.shape)[2]
    of_nodes = texels[layers:].reshape(-1, 4)
    assert len(of_nodes)
    is_node = of_nodes[:-1, 3] != 0.0
    np.testing.assert_array_equal(of_nodes[:-1][is_node], np.broadcast_to([0.0, 0.0, 0.0, 1.0], (is_node.sum(), 4)))


def test_parts_of_light_are_all_of_it(rng):
    """Light at once, later light and light of an even world are the light of paths."""
    grid = grid_of(strands_in_a_box(rng, 200), (0.1, 0.3, 1.0), voxel_count=300)
    light = surroundings(lamps=sun((0.0, 1.0, 0.0)), world=0.3)
    seen = seen_rays.seen_by(grid, light.corners, ALONG_Y, 2000)
    sums = gather.gather(grid, light, seen, 3000)
    (parts,), (all_light,) = sums._parts.of_systems(), sums.of_systems()
    found = sum(parts.numpy()[..., 6 * part : 6 * part + 3] for part in range(3))
    np.testing.assert_allclose(found, all_light.numpy()[..., :3], rtol=1e-4, atol=1e-5)
    assert all(parts.numpy()[..., 6 * part : 6 * part + 3].sum() > 0.0 for part in range(3))


def test_a_lone_strand_has_no_later_light():
    """All light of a lamp is direct, also by paths that leave the strand and hit the lamp."""
    grid = grid_of(np.linspace((-0.1, 0.0, -0.5), (0.1, 0.0, 0.5), 4)[None], WHITE, radius=0.05, voxel_count=30)
    lamps = sun((0.0, 1.0, 0.0))
    lamps["radius"] = 0.5
    light = surroundings(lamps=lamps, world=0.3)
    sums = gather.gather(grid, light, seen_rays.seen_by(grid, light.corners, ALONG_Y, 2000), 1000)
    at_once, later, of_world = (sums._parts.of_systems()[0].numpy()[..., at : at + 3].sum() for at in (0, 6, 12))
    assert at_once > 0.0 and of_world > 0.0
    assert abs(later) < 1e-5 * at_once


def test_texels_contain_voxels_and_nodes(rng):
    """The texels of nodes are where shaders/light/light_grid.glsl looks for them, and the last is their number."""
    voxels = rng.random((3, 5, 22, 4)).astype(np.float32)
    for strand_count, nodes in ((1, 4), (40, 7), (1000, 10)):
        values = rng.random((strand_count, nodes, 4)).astype(np.float32)
        texels = light_texels.packed(voxels, values)
        _depth, height, width = texels.shape[:3]
        layers = int(light_texels.sides_of((22, 5, 3))[2])
        assert not (np.array(texels.shape[:3]) & (np.array(texels.shape[:3]) - 1) == 0).any()
        np.testing.assert_array_equal(texels[:3, :5, :22], voxels)
        assert texels[-1, -1, -1, 0] == nodes
        in_row = width // nodes
        strand, node = np.indices(values.shape[:2])
        layer, rest = strand // (in_row * height), strand % (in_row * height)
        found = texels[layers + layer, rest // in_row, rest % in_row * nodes + node]
        np.testing.assert_array_equal(found, values)
    np.testing.assert_array_equal(light_texels.packed(voxels, None)[:3, :5, :22], voxels)
    assert len(light_texels.packed(voxels, np.zeros((100_000, 11, 4), np.float32))) == layers


@pytest.mark.parametrize("flat", range(3))
def test_flat_hair_has_nodes_in_any_direction(rng, flat):
    """A sheet of strands, for example a fringe, has about as many nodes whichever way it faces."""
    points = rng.uniform(0.0, 1.0, (200, 1, 3)) + np.linspace(0.0, 0.05, 4)[:, None] * np.ones(3)
    points[..., flat] = 0.0
    grid = grid_of(points, WHITE)
    nodes = strand_nodes.NodeSums(grid)
    assert grid.shape[flat] < 4 and nodes.has(0)
    texels = nodes.texels(0, *ratios_of(grid, 1.0, 0.0, 0.0))
    assert texels.shape[1] >= 10
    voxels = np.zeros((*grid.shape[::-1], 4), np.float32)
    assert light_texels.packed(voxels, texels)[-1, -1, -1, 0] == texels.shape[1]


def test_linked_long_and_very_many_strands_have_no_nodes(rng, monkeypatch):
    grid = two_systems(rng)
    assert [strand_nodes.NodeSums(grid).has(index) for index in range(2)] == [True, True]
    linked = strand_nodes.NodeSums(two_systems(rng, ("one", "one")))
    assert not linked.has(0) and not linked.has(1)
    assert not strand_nodes.NodeSums(replace(grid, voxel=1e-3 * grid.voxel)).has(0)
    monkeypatch.setattr(strand_nodes, "_MOST_NODES", 4 * 149)
    assert [strand_nodes.NodeSums(grid).has(index) for index in range(2)] == [True, False]
    for most in (4 * 150, 8 * 150):  # the first hair leaves nodes to the second
        monkeypatch.setattr(strand_nodes, "_MOST_NODES", most)
        nodes = strand_nodes.NodeSums(grid)
        assert [nodes.has(index) for index in range(2)] == [True, True] and len(nodes) <= most
    assert voxel_means.CHANNELS < strand_nodes.CHANNELS


def test_hair_without_nodes_has_no_sums_of_parts(rng, monkeypatch):
    """Sums of parts of light take more memory than all others, so hair without nodes does without them."""
    grid = grid_of(strands_in_a_box(rng, 200), WHITE, voxel_count=300)
    light = surroundings(lamps=sun((0.0, 1.0, 0.0)))
    seen = seen_rays.seen_by(grid, light.corners, ALONG_Y, 500)
    layers = light_texels.sides_of(grid.shape)[2]
    with_nodes = gather.gather(grid, light, seen, 500)
    monkeypatch.setattr(strand_nodes, "_MOST_NODES", 0)
    without = gather.gather(grid, light, seen, 500)
    without.see(seen, 0.5)
    with_nodes.see(seen, 0.5)
    assert with_nodes._parts is not None and without._parts is None
    (texels,), (others,) = without.texels(), with_nodes.texels()
    assert len(texels) == layers < len(others)
    np.testing.assert_array_equal(texels, others[:layers])
