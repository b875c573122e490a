# SPDX-License-Identifier: GPL-3.0-or-later
"""The least distances on a grid are at most those by brute force, and not much less."""

import numpy as np
import pytest
import warp as wp

from hair_addon.core.dynamics.collision.distance_grid import (
    DistanceGrid,
    distance_grid,
    distances_by_kernels,
    least_distance,
)
from tests.support.brute_force import distances
from tests.support.dynamics.contacts import bumpy, sheet
from tests.support.meshes import flat_grid
from tests.support.pairs import pairs

wp.set_module_options({"enable_backward": False})


@wp.kernel
def _ask(grid: DistanceGrid, points: wp.array[wp.vec3], out_distances: wp.array[float]):
    point = wp.tid()
    out_distances[point] = least_distance(grid, points[point])


def asked(grid, points, device):
    """Return the least distances of points (N, 3)."""
    found = wp.zeros(len(points), dtype=float, device=device)
    given = wp.array(points.astype(np.float32), dtype=wp.vec3, device=device)
    wp.launch(_ask, len(points), inputs=[grid, given], outputs=[found], device=device)
    return found.numpy()


@pytest.mark.parametrize(("shape", "cell_count"), pairs([bumpy, sheet], [1, 1000, 40_000, 10**7], 2))
def test_distances_are_never_more_than_by_brute_force(device, rng, shape, cell_count):
    mesh = shape(rng)
    grid = distance_grid(mesh.vertices, mesh.triangles, cell_count, device)
    points = rng.uniform(-0.3, 0.3, (600, 3))
    points[:200] = mesh.corners.mean(axis=1)[rng.integers(len(mesh.triangles), size=200)] + rng.normal(
        0.0, 0.01, (200, 3)
    )
    true = distances(points, mesh)
    least = asked(grid, points, device)
    assert (least <= true + 1e-6).all()
    # Among the triangles: a triangle's box and a cell beside it, a cell beside the point, and as far as is counted.
    loose = np.linalg.norm(np.ptp(mesh.corners, axis=1), axis=1).max() + 2.0 * np.sqrt(3.0) * grid.size
    is_among = ((points >= mesh.vertices.min(axis=0)) & (points <= mesh.vertices.max(axis=0))).all(axis=1)
    assert is_among.sum() > 30
    assert (least >= np.minimum(true, 15.0 * grid.size) - loose)[is_among].all()


@pytest.mark.parametrize("cell_count", [1, 1000, 40_000])
@pytest.mark.parametrize("shape", [bumpy, sheet])
def test_kernels_find_what_numpy_finds(device, rng, shape, cell_count):
    mesh = shape(rng)
    grid = distance_grid(mesh.vertices, mesh.triangles, cell_count, "cpu")
    places = (mesh.vertices - np.array(grid.low)) / grid.size
    found = distances_by_kernels(places, mesh.triangles, np.array(grid.last), grid.size, device)
    np.testing.assert_allclose(found.numpy(), grid.distances.numpy(), rtol=1e-6)


def test_a_mesh_without_height_has_a_grid(device):
    mesh = flat_grid(3, 0.1)
    grid = distance_grid(mesh.vertices, mesh.triangles, 1000, device)
    points = np.array([[0.05, 0.05, 0.08], [0.05, 0.05, 0.0], [1.0, 0.05, 0.0], [0.05, 0.05, -1e9]])
    least = asked(grid, points, device)
    assert least[1] == 0.0 and 0.05 < least[0] <= 0.08 and 0.87 < least[2] <= 0.9 and least[3] > 0.99e9


def test_what_has_moved_may_be_nearer(device, rng):
    mesh = bumpy(rng)
    grid = distance_grid(mesh.vertices, mesh.triangles, 5000, device)
    grid.drift = 0.02
    points = rng.uniform(-0.3, 0.3, (400, 3))
    ways = rng.normal(size=(len(mesh.vertices), 3))
    ways *= 0.02 / np.linalg.norm(ways, axis=1, keepdims=True)
    moved = type(mesh)((mesh.vertices + ways).astype(np.float32), mesh.triangles)
    assert (asked(grid, points, device) <= distances(points, moved) + 1e-6).all()
