# SPDX-License-Identifier: GPL-3.0-or-later
"""Places where paths start are tried in the order of nearby voxels."""

import numpy as np
import warp as wp

from hair_addon.core.shading.light_paths import media, start_places
from tests.core.shading.light_paths.test_gather import WHITE, grid_of, strands_in_a_box


def code_of(at):
    """Return the number whose bits are those of three indices in turn, the first index lowest."""
    digits = [f"{index:010b}" for index in at]
    return int("".join(z + y + x for x, y, z in zip(*digits, strict=True)), 2)


def test_starts_of_nearby_voxels_follow_each_other(rng):
    grid = grid_of(strands_in_a_box(rng, 300), WHITE, voxel_count=5_000)
    medium = media.unlit_medium_of(grid, None)
    segments = rng.permutation(np.flatnonzero(np.diff(grid.strands.numpy()) == 0)).astype(np.int32)
    keys = np.arange(len(segments), dtype=np.int32)
    given = [wp.array(values, dtype=int, device="cpu") for values in (segments, keys)]
    found, found_keys = (array.numpy() for array in start_places._by_voxels(medium, *given))
    at = np.floor((grid.points.numpy()[segments] - grid.corner) / grid.voxel).astype(int)
    codes = [code_of(np.clip(row, 0, np.array(grid.shape) - 1)) for row in at]
    order = np.argsort(codes, kind="stable")
    np.testing.assert_array_equal(found, segments[order])
    np.testing.assert_array_equal(found_keys, order)
