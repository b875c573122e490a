# SPDX-License-Identifier: GPL-3.0-or-later
"""Every segment is in exactly the cells that it touches with its width."""

import numpy as np
import pytest

from hair_addon.core.shading.light_paths import strand_cells
from tests.core.shading.light_paths.test_gather import WHITE, grid_of
from tests.core.shading.light_paths.test_grid_walk import mixed_strands


def touching(grid, wider):
    """Return {(cell along X, Y, Z, segment)} of the cells that a segment touches with its radius, slightly enlarged."""
    points, radii, strands = (array.numpy().astype(float) for array in (grid.points, grid.radii, grid.strands))
    segments = np.flatnonzero(np.diff(strands) == 0)
    k = grid.cells.along_voxel
    side, found = grid.voxel / k, set()
    low = grid.corner + side * np.stack(np.meshgrid(*(np.arange(n * k) for n in grid.shape), indexing="ij"), axis=-1)
    low = low.reshape(-1, 3)
    for segment in segments:
        radius = radii[segment : segment + 2].max() + wider * side
        way = points[segment + 1] - points[segment]
        way = np.where(np.abs(way) < 1e-20, 1e-20, way)
        ends = np.stack([low - radius, low + side + radius]) - points[segment]
        parts = ends / way
        enter = np.maximum(parts.min(axis=0).max(axis=-1), 0.0)
        leave = np.minimum(parts.max(axis=0).min(axis=-1), 1.0)
        cells = np.rint((low[enter <= leave] - grid.corner) / side).astype(int)
        found |= {(*cell, segment) for cell in cells.tolist()}
    return found


def listed(grid):
    """Return (the same from a grid's own lists, whether segments rise in every cell)."""
    cells, k = grid.cells, grid.cells.along_voxel
    bricks, starts, segments = (array.numpy() for array in (cells.bricks, cells.starts, cells.segments))
    assert starts[0] == 0 and starts[-1] == len(segments) and (np.diff(starts) >= 0).all()
    cell = np.repeat(np.arange(len(starts) - 1), np.diff(starts))
    voxels = np.flatnonzero(bricks >= 0)
    assert (bricks[voxels] == np.arange(len(voxels))).all() and len(starts) == len(voxels) * k**3 + 1
    z, y, x = np.unravel_index(voxels[cell // k**3], grid.shape[::-1])
    in_z, in_y, in_x = np.unravel_index(cell % k**3, (k, k, k))
    rows = np.stack([x * k + in_x, y * k + in_y, z * k + in_z, segments], axis=-1)
    is_rising = (np.diff(segments) > 0) | (np.diff(cell) > 0)
    return {tuple(row) for row in rows.tolist()}, is_rising.all() and len(rows) == len(np.unique(rows, axis=0))


@pytest.mark.parametrize("voxel_count", [1, 40, 400])
def test_cells_have_the_segments_that_touch_them(rng, voxel_count):
    points, radii = mixed_strands(rng, 25)
    grid = grid_of(points, WHITE, radii, voxel_count=voxel_count)
    found, is_rising = listed(grid)
    assert is_rising
    assert touching(grid, 0.0) <= found <= touching(grid, 2e-4)


def test_strands_in_another_order_are_in_the_same_cells(rng):
    points, radii = mixed_strands(rng, 200)
    order = rng.permutation(len(points))
    one, other = (grid_of(points[rows], WHITE, radii[rows], voxel_count=200) for rows in (slice(None), order))
    turned = {(x, y, z, 5 * order[segment // 5] + segment % 5) for x, y, z, segment in listed(other)[0]}
    assert listed(one)[0] == turned


def test_a_gpu_sorts_as_cores_do(rng, monkeypatch):
    """A GPU sorts as cores do: both ways on the processor give the same lists to the bit, on any number of cores."""
    points, radii = mixed_strands(rng, 300)
    lists = []
    for name, share in (("_by_sorting", 1), ("_by_cores", 1), ("_by_cores", 5)):
        monkeypatch.setattr(strand_cells.parallel, "share_count", lambda *_, share=share: share)
        with monkeypatch.context() as chosen:
            chosen.setattr(strand_cells, "_by_cores", getattr(strand_cells, name))
            cells = grid_of(points, WHITE, radii, voxel_count=500).cells
        lists.append([array.numpy() for array in (cells.bricks, cells.starts, cells.segments, cells.lines)])
    for found in lists[1:]:
        for values, expected in zip(found, lists[0], strict=True):
            np.testing.assert_array_equal(values, expected)
