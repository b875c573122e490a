# SPDX-License-Identifier: GPL-3.0-or-later
"""Tracing through cells of segments finds the same hits as brute force."""

import numpy as np
import pytest
import warp as wp

from hair_addon.core.shading.light_paths import media
from hair_addon.core.shading.light_paths.grid_walk import (
    FAR,
    PASSED,
    STRAND,
    SURFACE,
    Medium,
    crossing,
    is_blocked,
    walk,
)
from hair_addon.core.shading.light_paths.strand_cells import LINE_CENTRE, LINE_ERROR, line_from, line_of, line_step
from tests.core.shading.light_paths.test_gather import WHITE, grid_of

wp.set_module_options({"enable_backward": False})

RAYS = 4000
WALL = np.array([(-4, 0.4, -4), (4, 0.4, -4), (0, 0.4, 8)], float)


@wp.kernel
def _by_walking(
    medium: Medium,
    places: wp.array[wp.vec3],
    directions: wp.array[wp.vec3],
    most: float,
    own: wp.array[int],
    out_kind: wp.array[int],
    out_distance: wp.array[float],
    out_segment: wp.array[int],
    out_is_blocked: wp.array[int],
):
    ray = wp.tid()
    hit = walk(medium, places[ray], directions[ray], most, own[ray])
    out_is_blocked[ray] = int(is_blocked(medium, places[ray], directions[ray], most, own[ray]))
    out_kind[ray] = hit.kind
    out_distance[ray] = wp.length(hit.position - places[ray])
    out_segment[ray] = hit.index


@wp.kernel
def _by_all_segments(
    medium: Medium,
    places: wp.array[wp.vec3],
    directions: wp.array[wp.vec3],
    own: wp.array[int],
    out_distance: wp.array[float],
    out_segment: wp.array[int],
):
    ray = wp.tid()
    nearest = float(FAR)
    found = int(-1)
    for segment in range(medium.points.shape[0] - 1):
        is_one = medium.strands[segment] == medium.strands[segment + 1]
        if is_one and medium.strands[segment] != own[ray]:
            distance, _offset = crossing(medium, segment, places[ray], directions[ray])
            if distance < nearest:
                nearest = distance
                found = segment
    out_distance[ray] = nearest
    out_segment[ray] = found


def mixed_strands(rng, count=700):
    """Return long and short strands in a box twice as long as wide, some of no length, with widths from one to
    twenty.
    """
    middles = rng.uniform(-0.5, 0.5, (count, 1, 3)) * [2.0, 1.0, 1.0]
    ways = rng.normal(size=(count, 1, 3)) * rng.choice([0.0, 0.01, 0.2], (count, 1, 1), p=[0.02, 0.5, 0.48])
    points = middles + np.linspace(-1.0, 1.0, 5)[:, None] * ways + rng.normal(0.0, 0.004, (count, 5, 3))
    points[:20] = middles[:20]
    return points, rng.choice([0.0007, 0.003, 0.014], (count, 1)) * rng.uniform(0.3, 1.0, (count, 5))


def rays(rng, medium_points):
    """Return rays from within strands, from among them and from far away, along any direction and along axes."""
    places = rng.uniform(-0.6, 0.6, (RAYS, 3)) * [2.0, 1.0, 1.0]
    directions = rng.normal(size=(RAYS, 3))
    directions[::5] = np.eye(3)[rng.integers(0, 3, len(directions[::5]))] * rng.choice([-1.0, 1.0], (RAYS // 5, 1))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    places[::3] = medium_points[rng.integers(0, len(medium_points), len(places[::3]))]
    places[1::7] -= 5.0 * directions[1::7]
    return places, directions


@pytest.mark.parametrize("voxel_count", [1, 60, 4000])
def test_the_nearest_segment_is_found(rng, voxel_count):
    points, radii = mixed_strands(rng)
    grid = grid_of(points, WHITE, radii, voxel_count=voxel_count)
    places, directions = rays(rng, grid.points.numpy())
    own = rng.integers(-1, len(points), RAYS)
    with wp.ScopedDevice("cpu"):
        medium = media.medium_of(grid, None, np.zeros((0, 3)), np.zeros((0, 3)))
        given = [medium, wp.array(places, dtype=wp.vec3), wp.array(directions, dtype=wp.vec3)]
        numbers = wp.array(own, dtype=int)
        found = [wp.zeros(RAYS, dtype=kind) for kind in (int, float, int, int)]
        wp.launch(_by_walking, RAYS, [*given, FAR, numbers], found)
        medium.at_once = 1  # as on a GPU
        one_by_one = [wp.zeros(RAYS, dtype=kind) for kind in (int, float, int, int)]
        wp.launch(_by_walking, RAYS, [*given, FAR, numbers], one_by_one)
        expected = [wp.zeros(RAYS, dtype=kind) for kind in (float, int)]
        wp.launch(_by_all_segments, RAYS, [*given, numbers], expected)
    kinds, distances, segments, blocked = (array.numpy() for array in found)
    nearest, nearest_segments = (array.numpy() for array in expected)
    is_met = nearest_segments >= 0
    assert 0.2 < is_met.mean() < 0.9
    assert ((kinds == STRAND) == is_met).all()
    assert (blocked == is_met).all()
    assert (segments[is_met] == nearest_segments[is_met]).mean() > 0.999  # two that cross are as near
    assert np.abs(distances - nearest)[is_met].max() < 1e-5
    for values, of_one in zip(found, one_by_one, strict=True):
        np.testing.assert_array_equal(values.numpy(), of_one.numpy())


def test_strands_hide_a_wall_and_it_hides_them(rng):
    points, radii = mixed_strands(rng)
    grid = grid_of(points, WHITE, radii, voxel_count=500)
    places, directions = rays(rng, grid.points.numpy())
    with wp.ScopedDevice("cpu"):
        mesh = media.mesh_of(WALL)
        rows = [wp.array(values, dtype=wp.vec3) for values in (places, directions)]
        own, found = wp.full(RAYS, -1, dtype=int), []
        for wall, count, most in ((mesh, 1, FAR), (None, 0, FAR), (mesh, 1, 0.3)):
            medium = media.medium_of(grid, wall, np.zeros((3 * count, 3)), np.zeros((count, 3)))
            arrays = [wp.zeros(RAYS, dtype=kind) for kind in (int, float, int, int)]
            wp.launch(_by_walking, RAYS, [medium, *rows, most, own], arrays)
            found.append([array.numpy() for array in arrays])
    (kinds, distances, *_), (without, strands_at, *_), _near = found
    for met, *_places, blocked in found:
        assert ((met != PASSED) == blocked).all()
    with np.errstate(divide="ignore", invalid="ignore"):
        to_wall = (0.4 - places[:, 1]) / directions[:, 1]
    at = places + np.where(np.isfinite(to_wall), to_wall, 0.0)[:, None] * directions
    is_beside = (to_wall > 1e-6) & (np.abs(at[:, 0]) < 2.0) & (np.abs(at[:, 2]) < 2.0)  # well within the triangle
    expected = np.where(is_beside & (to_wall < np.where(without == STRAND, strands_at, np.inf)), SURFACE, without)
    is_clear = is_beside | ~(to_wall > 0.0)
    assert 0.1 < (expected == SURFACE).mean() < 0.9
    assert (kinds == expected)[is_clear].all()
    assert np.allclose(distances[is_beside & (kinds == SURFACE)], to_wall[is_beside & (kinds == SURFACE)], atol=1e-5)


@wp.kernel
def _there_and_back(
    origins: wp.array[wp.vec3],
    ways: wp.array[wp.vec3],
    side: float,
    out_points: wp.array[wp.vec3],
    out_ways: wp.array[wp.vec3],
    out_widths: wp.array[float],
):
    line = wp.tid()
    where, turned = line_of(origins[line], ways[line], wp.vec3(0.0, 0.0, 0.0), side, line % 4)
    point, way, wider = line_from(where, turned)
    out_points[line] = line_step(side) * (point - wp.vec3(LINE_CENTRE, LINE_CENTRE, LINE_CENTRE))
    out_ways[line] = way
    out_widths[line] = wider


def test_lines_are_kept_as_well_as_it_is_said(rng):
    side, count = 0.3, 20_000
    nearest = rng.uniform(-1.0, 1.0, (count, 3)) * side
    ways = rng.normal(size=(count, 3)) * 10.0 ** rng.uniform(-4.0, 0.0, (count, 1))
    ways[::10] *= np.eye(3)[rng.integers(0, 3, len(ways[::10]))]  # along axes, where an octahedron has its corners
    origins = nearest + rng.uniform(-3.0, 3.0, (count, 1)) * ways
    found = [wp.zeros(count, dtype=kind, device="cpu") for kind in (wp.vec3, wp.vec3, float)]
    rows = [wp.array(values, dtype=wp.vec3, device="cpu") for values in (origins, ways)]
    wp.launch(_there_and_back, count, [*rows, side], found, device="cpu")
    points, kept, widths = (array.numpy().astype(float) for array in found)
    unit, kept = (values / np.linalg.norm(values, axis=1, keepdims=True) for values in (ways, kept))
    assert (widths == 0.5 ** (np.arange(count) % 4 - 3.0)).all()
    ends = points[:, None] + np.array([-1.7, 0.0, 1.7])[:, None] * side * kept[:, None]
    beside = np.cross(ends - origins[:, None], unit[:, None])
    assert np.linalg.norm(beside, axis=-1).max() < LINE_ERROR * side
