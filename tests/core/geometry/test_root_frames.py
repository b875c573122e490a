# SPDX-License-Identifier: GPL-3.0-or-later
"""Roots on a device equal those computed by NumPy."""

import numpy as np
import pytest

from hair_addon.core.geometry import mesh as mesh_math
from hair_addon.core.geometry.mesh import SurfacePoints, TriMesh
from hair_addon.core.geometry.root_frames import rooted
from hair_addon.core.geometry.sampling import sample_surface
from tests.support.devices import DEVICE


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_roots_are_where_numpy_says(head, scale):
    scaled = TriMesh(np.float32(scale) * head.vertices, head.triangles)
    points = sample_surface(scaled, 9000, 1)
    positions, normals = (array.numpy() for array in rooted(scaled, points, DEVICE))
    np.testing.assert_array_equal(positions, mesh_math.positions(scaled, points))
    np.testing.assert_allclose(normals, mesh_math.normals(scaled, points), atol=1e-6)


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_where_normals_cancel_the_triangle_has_the_say(scale):
    """Where smooth normals cancel, as on a sheet whose sides share vertices, roots have the normal of their
    triangle.
    """
    vertices = np.float32(scale) * np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0)], np.float32)
    sheet = TriMesh(vertices, np.array([(0, 1, 2), (0, 2, 1)], np.int32))
    points = SurfacePoints(np.array([0, 1], np.int32), np.full((2, 3), 1.0 / 3.0, np.float32))
    _, normals = rooted(sheet, points, DEVICE)
    np.testing.assert_array_equal(normals.numpy(), [(0, 0, 1), (0, 0, -1)])
    np.testing.assert_array_equal(mesh_math.normals(sheet, points), normals.numpy())
