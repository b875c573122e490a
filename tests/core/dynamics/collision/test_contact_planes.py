# SPDX-License-Identifier: GPL-3.0-or-later
"""Contact planes are those of the nearest surface by brute force, at the distance that the groom allows."""

import numpy as np
import pytest
import warp as wp

from hair_addon.core.dynamics.collision.colliders import Collider, Colliders
from hair_addon.core.dynamics.collision.contact import PLANE, RISE, Contacts
from hair_addon.core.errors import HairError
from hair_addon.core.geometry.mesh import TriMesh
from tests.support.brute_force import distances, is_inside
from tests.support.dynamics.contacts import (
    FAR,
    LANES,
    STEP,
    Asked,
    around,
    bumpy,
    gaps_of,
    groom_of,
    is_plane,
    lanes_of,
    planes_of,
)
from tests.support.meshes import flat_grid, subdivided_sphere


def test_planes_are_those_of_the_nearest_surface(device, rng):
    for friction, distance in ((0.3, 1e-3), (0.7, 3e-3)):
        mesh = bumpy(rng)
        colliders = Colliders(device)
        colliders.read([Collider("a", mesh, friction, distance)])
        points = around(rng, mesh, 400)
        planes = Asked(colliders, len(points))(points)
        apart = distances(points, mesh)
        signed = np.where(is_inside(points, mesh), -apart, apart)
        found = is_plane(planes)
        clear = np.abs(apart - distance - 1e-3) > 1e-6
        np.testing.assert_array_equal(found[clear], (apart < distance + 1e-3)[clear])
        points, planes, signed = points[found], planes[found], signed[found]
        assert len(points) > 100 and (signed < 0).sum() > 50
        np.testing.assert_allclose(np.linalg.norm(planes[:, :3], axis=1), 1.0, atol=1e-6)
        np.testing.assert_allclose(gaps_of(planes, points), signed - distance, atol=3e-7)
        # The point of the surface that the normal comes from.
        foot = points - (gaps_of(planes, points) + distance)[:, None] * planes[:, :3]
        assert distances(foot, mesh).max() < 1e-6
        np.testing.assert_array_equal(planes[:, 7], np.float32(friction))
        assert not planes[:, 4:7].any()


def test_of_several_colliders_the_nearest_counts(device, rng):
    ball = subdivided_sphere(3, 0.05)
    others = [TriMesh(ball.vertices + np.float32([shift, 0, 0]), ball.triangles) for shift in (0.0, 0.103)]
    colliders = Colliders(device)
    colliders.read([Collider("a", others[0], 0.1, 1e-3), Collider("b", others[1], 0.5, 2e-3)])
    points = np.array([0.0515, 0, 0]) + rng.uniform(-0.0009, 0.0009, (64, 3))
    planes = Asked(colliders, len(points))(points)
    first, second = (distances(points, mesh) for mesh in others)
    np.testing.assert_array_equal(planes[:, 7], np.where(first < second, np.float32(0.1), np.float32(0.5)))
    wanted = np.where(first < second, first - 1e-3, second - 2e-3)
    np.testing.assert_allclose(gaps_of(planes, points), wanted, atol=3e-7)


def test_beyond_the_rim_of_an_open_mesh_is_no_inside(device):
    colliders = Colliders(device)
    colliders.read([Collider("a", flat_grid(3, 0.1))])
    points = np.array([[-0.001, 0.05, -0.0005], [0.05, 0.101, -0.001], [-0.001, -0.001, -0.0001], [0.05, 0.05, -0.001]])
    planes = Asked(colliders, 4)(points)
    apart = distances(points, flat_grid(3, 0.1)) * [1, 1, 1, -1]
    np.testing.assert_allclose(gaps_of(planes, points), apart - 1e-3, atol=1e-7)


@pytest.mark.parametrize("is_double_sided", [False, True])
def test_the_groom_is_pushed_nowhere(device, rng, is_double_sided):
    mesh = bumpy(rng)
    colliders = Colliders(device)
    colliders.read([Collider("a", mesh, is_double_sided=is_double_sided)])
    strands = groom_of(rng, mesh, 160, 0.006)
    groom = lanes_of(strands, device)
    contacts = Contacts(groom, colliders)
    planes = planes_of(contacts.find(groom, groom, 0.0), 8)
    flat, points = planes.reshape(-1, PLANE), strands.reshape(-1, 3)
    found = is_plane(flat)
    assert found.sum() > 400 and gaps_of(flat[found], points[found]).min() > -3e-7


def test_points_that_the_groom_has_inside_rise_slowly_to_the_surface(device):
    colliders = Colliders(device)
    ball = subdivided_sphere(4, 0.1)
    colliders.read([Collider("a", ball)])
    depths = np.array([0.0005, 0.002, 0.008, 0.03])
    points = np.stack([0.1 - depths, 0 * depths, 0 * depths], axis=1)
    asked = Asked(colliders, 4, points)
    inside = distances(points, ball)
    for substep in range(1, 400):
        planes = asked(points)
        lifted = np.minimum(inside, RISE * STEP * substep)
        np.testing.assert_allclose(-gaps_of(planes, points), lifted, atol=2e-6)
        assert (planes[:, 0] > 0.5).all()
        np.testing.assert_array_equal(asked(points, is_final=True), planes)


def test_points_near_the_surface_in_the_groom_keep_their_distance(device):
    colliders = Colliders(device)
    colliders.read([Collider("a", flat_grid(4, 0.1), distance=2e-3)])
    heights = np.array([0.0, 0.0005, 0.0019, 0.0021, 0.03])
    points = np.stack([0 * heights + 0.05, 0 * heights + 0.05, heights], axis=1)
    planes = Asked(colliders, 5, points)(points * [1, 1, 0])
    np.testing.assert_allclose(planes[:, 3], np.minimum(heights, 2e-3), atol=1e-7)


def test_a_segment_keeps_its_middle_outside(device):
    """Both ends of a segment take the plane of a ridge between them, which keeps the middle outside; roots do not
    move.
    """
    ridge = np.array(
        [[-1, -0.02, -0.02], [1, -0.02, -0.02], [-1, 0, 0], [1, 0, 0], [-1, 0.02, -0.02], [1, 0.02, -0.02]]
    )
    triangles = np.array([[0, 1, 2], [1, 3, 2], [2, 3, 4], [3, 5, 4]], np.int32)
    mesh = TriMesh((0.1 * ridge * [1, 10, 10]).astype(np.float32), triangles)
    colliders = Colliders(device)
    colliders.read([Collider("a", mesh)])
    strand = np.array([[0.0, -0.012, 0.0], [0.0, -0.004, 0.0003], [0.0, 0.004, 0.0003], [0.0, 0.012, 0.0]])
    strands = np.repeat(strand[None], LANES, axis=0)
    contacts = Contacts(lanes_of(strands + FAR, device), colliders)
    planes = planes_of(contacts.find(lanes_of(strands, device), lanes_of(strands, device), STEP), 4)[0].astype(float)
    assert not planes[0].any()
    np.testing.assert_allclose(planes[1:3, :3], [[0, 0, 1]] * 2, atol=1e-6)
    gaps = gaps_of(planes[1:3], strand[1:3])
    np.testing.assert_allclose(gaps, -0.0007, atol=1e-6)
    raised = strand[1:3] - gaps[:, None] * planes[1:3, :3]
    np.testing.assert_allclose(raised.mean(axis=0), [0, 0, 0.001], atol=1e-6)
    final = planes_of(contacts.find(lanes_of(strands, device), lanes_of(strands, device), STEP, is_final=True), 4)[0]
    apart = distances(strand, mesh)
    wanted = np.where(apart < 0.002, apart - 0.001, 0.0)[1:]
    np.testing.assert_allclose(gaps_of(final[1:].astype(float), strand[1:]), wanted, atol=1e-6)


def test_positions_that_are_no_numbers_and_absurd_ones_have_no_plane(device):
    colliders = Colliders(device)
    colliders.read([Collider("a", subdivided_sphere(2, 0.1))])
    points = np.full((4, 3), np.nan)
    points[1], points[2], points[3] = np.inf, 1e30, 1e9
    asked = Asked(colliders, 4, points)
    assert not asked(points).any()
    assert not asked(points, np.zeros((4, 3))).any()


def test_arrays_of_other_shapes_are_refused(device):
    colliders = Colliders(device)
    for shape in ((2, 7, LANES), (2, 3, LANES)):
        with pytest.raises(HairError):
            Contacts(wp.zeros(shape, dtype=float, device=device), colliders)
    good = wp.zeros((2, 9, LANES), dtype=float, device=device)
    contacts = Contacts(good, colliders)
    for shape in ((1, 9, LANES), (2, 12, LANES), (2, 9, 4)):
        with pytest.raises(HairError):
            contacts.find(wp.zeros(shape, dtype=float, device=device), good, STEP)
