# SPDX-License-Identifier: GPL-3.0-or-later
"""The mean curvature of known shapes is their curvature."""

import numpy as np
import pytest

from hair_addon.core.geometry.curvature import bend_density, mean_curvature
from hair_addon.core.geometry.mesh import TriMesh
from tests.support.meshes import subdivided_sphere


@pytest.mark.parametrize("radius", [0.1, 1.0, 30.0])
def test_a_sphere_bends_by_one_over_its_radius(radius):
    found = mean_curvature(subdivided_sphere(4, radius)) * radius
    assert abs(np.mean(found) - 1.0) < 0.03
    assert found.min() > 0.8 and found.max() < 1.3  # triangles of many shapes


def test_a_cylinder_bends_half_as_much():
    around = np.linspace(0.0, 2.0 * np.pi, 65)[:-1]
    rings = [np.stack([0.5 * np.cos(around), 0.5 * np.sin(around), np.full(64, z)], axis=1) for z in range(5)]
    corner = np.arange(64)
    following = (corner + 1) % 64
    triangles = [
        np.concatenate(
            [np.stack([corner, following, corner + 64], 1), np.stack([following, following + 64, corner + 64], 1)]
        )
        + 64 * ring
        for ring in range(4)
    ]
    found = mean_curvature(
        TriMesh(np.concatenate(rings).astype(np.float32), np.concatenate(triangles).astype(np.int32))
    )
    np.testing.assert_allclose(found[64:-64], 1.0, rtol=0.01)  # 1 / (2 × 0.5)


def test_a_plane_does_not_bend(square):
    assert mean_curvature(square).max() == 0.0
    np.testing.assert_array_equal(bend_density(square, 3.0), 1.0)


def test_faces_wound_the_other_way_bend_the_same(sphere, rng):
    turned = sphere.triangles.copy()
    some = rng.random(len(turned)) < 0.5
    turned[some] = turned[some][:, ::-1]
    found = mean_curvature(TriMesh(sphere.vertices, turned))
    assert np.isfinite(found).all()


@pytest.mark.parametrize("scale", [1e-6, 1e6])
def test_density_does_not_depend_on_size(sphere, scale):
    large = TriMesh((np.float32(scale) * sphere.vertices), sphere.triangles)
    np.testing.assert_allclose(bend_density(large, 2.0), bend_density(sphere, 2.0), rtol=1e-3)
