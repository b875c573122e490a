# SPDX-License-Identifier: GPL-3.0-or-later
"""Planes of contact: those of the nearest surface by brute force, with its motion; nothing passes through."""

from itertools import pairwise

import numpy as np
import pytest
import warp as wp
from scipy.spatial.transform import Rotation

from hair_addon.core.dynamics.colliders import Collider, Colliders
from hair_addon.core.dynamics.contact import PLANE, RISE, Contacts
from hair_addon.core.errors import HairError
from hair_addon.core.geometry.mesh import TriMesh
from tests.support.brute_force import distances, is_inside
from tests.support.meshes import flat_grid, subdivided_sphere

LANES = 8
STEP = 1.0 / 192.0  # [s]
FAR = 10.0  # [m] from any collider


def lanes_of(strands, device):
    """(S, N, 3) points of strands, S a multiple of LANES → lane groups."""
    count = strands.shape[1]
    groups = strands.reshape(-1, LANES, 3 * count).transpose(0, 2, 1)
    return wp.array(np.ascontiguousarray(groups, np.float32), dtype=float, device=device)


def planes_of(found, vertex_count):
    """Planes (S, N, 8) of what `find` returned, by strand."""
    return found.numpy().reshape(-1, vertex_count, PLANE, LANES).transpose(0, 3, 1, 2).reshape(-1, vertex_count, PLANE)


def strands_of(points):
    """Points (N, 3) as the tips of strands whose roots are far away, and whose segments are too."""
    count = -(-len(points) // LANES) * LANES
    strands = np.full((count, 2, 3), FAR, np.float32)
    strands[: len(points), 1] = points
    return strands


class Asked:
    """Tips that ask colliders for planes, without segments."""

    def __init__(self, colliders, count, groom=None):
        self.count, self.device = count, colliders.device
        groom = np.full((count, 3), FAR) if groom is None else groom
        self.contacts = Contacts(lanes_of(strands_of(groom), self.device), colliders)

    def __call__(self, points, last=None, **details):
        last = points if last is None else last
        there, before = (lanes_of(strands_of(np.float32(places)), self.device) for places in (points, last))
        found = planes_of(self.contacts.find(there, before, STEP, **details), 2)
        assert not found[:, 0].any()  # roots
        return found[: self.count, 1].astype(np.float64)


def gaps_of(planes, points):
    """How far points are in front of their planes."""
    return np.einsum("ni,ni->n", planes[:, :3], points) - planes[:, 3]


def is_plane(planes):
    return np.linalg.norm(planes[:, :3], axis=1) > 0.5


def bumpy(rng, radius=0.1):
    """A closed mesh with ridges and hollows, around the origin."""
    ball = subdivided_sphere(2, radius)
    return TriMesh(ball.vertices * rng.uniform(0.8, 1.1, (len(ball.vertices), 1)).astype(np.float32), ball.triangles)


def around(rng, mesh, count, most=0.004):
    """Points near a mesh, on both sides."""
    corners = mesh.corners[rng.integers(len(mesh.triangles), size=count)]
    weights = rng.dirichlet(np.ones(3), count)
    return np.einsum("nk,nki->ni", weights, corners) + rng.uniform(-most, most, (count, 3))


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


@pytest.mark.parametrize("substeps", [1, 4])
def test_the_displacement_is_the_surfaces(device, rng, substeps):
    """Exact for a rigid motion: of the point of the surface that is touched, in each substep a part of the frame's."""
    mesh, turn, shift = bumpy(rng), Rotation.from_rotvec([0.02, -0.05, 0.04]), np.array([0.003, 0.001, -0.004])
    after = TriMesh((turn.apply(mesh.vertices) + shift).astype(np.float32), mesh.triangles)
    colliders = Colliders(device)
    for pose in (mesh, after):
        colliders.read([Collider("a", pose)])
    for step in range(substeps):
        part = (step + 1) / substeps
        colliders.pose(part)
        now = TriMesh((mesh.vertices + part * (after.vertices - mesh.vertices)).astype(np.float32), mesh.triangles)
        points = around(rng, now, 300)
        planes = Asked(colliders, len(points))(points)
        found = is_plane(planes)
        points, planes = points[found], planes[found]
        foot = points - (gaps_of(planes, points) + 1e-3)[:, None] * planes[:, :3]
        # But for points that it has passed over, whose plane is where they went in.
        is_foot = distances(foot, now) < 1e-6
        assert is_foot.mean() > 0.9
        foot, planes = foot[is_foot], planes[is_foot]
        # foot = (1 - part) x + part (R x + shift) for the point x of the first pose.
        motion = part * (turn.as_matrix() - np.eye(3))
        x = np.linalg.solve(np.eye(3) + motion, (foot - part * shift).T).T
        np.testing.assert_allclose(planes[:, 4:7], (turn.apply(x) + shift - x) / substeps, atol=1e-6)


def test_a_point_that_is_not_asked_has_no_plane_to_miss(device, rng):
    """Strands that drift about a mesh that turns and swells: the same planes, spared or not, bit by bit."""
    mesh = bumpy(rng)
    colliders = Colliders(device)
    colliders.read([Collider("a", mesh, is_double_sided=True), Collider("b", flat_grid(2, 0.05), is_double_sided=True)])
    count = 6
    strands = rng.uniform(-0.12, 0.12, (160, 1, 3)) + np.cumsum(rng.normal(0, 0.004, (160, count, 3)), axis=1)
    sparing, asking = (Contacts(lanes_of(strands, device), colliders) for _ in range(2))
    speeds = rng.choice([0.0, 1e-5, 2e-4, 0.004], (160, 1, 1))
    spared = found = 0
    for frame in range(4):
        turn, size = Rotation.from_rotvec([0.0, 0.0, 0.05 * frame]), 1.0 + 0.1 * frame
        now = TriMesh((size * turn.apply(mesh.vertices)).astype(np.float32), mesh.triangles)
        sheet = Collider("b", flat_grid(2, 0.05), is_double_sided=True)
        colliders.read([Collider("a", now, is_double_sided=True), sheet])
        for step in range(6):
            colliders.pose((step + 1) / 6)
            last, strands = strands, strands + speeds * rng.normal(size=(160, 1, 3))
            there, before = lanes_of(strands, device), lanes_of(last, device)
            held = sparing._vertices.asked.numpy().copy()
            planes = sparing.find(there, before, STEP).numpy().copy()
            np.testing.assert_array_equal(planes, asking.find(there, before, STEP, is_skipping=False).numpy())
            spared += (held == sparing._vertices.asked.numpy()).mean() / 24
            found += np.any(planes, axis=1).mean() / 24
            final = sparing.find(there, before, STEP, is_final=True).numpy().copy()
            np.testing.assert_array_equal(
                final, asking.find(there, before, STEP, is_final=True, is_skipping=False).numpy()
            )
    assert spared > 0.2 and found > 0.1


def sheet(rng):
    """A bumpy square of 0.2 m at z = 0."""
    grid = flat_grid(6, 0.2)
    vertices = grid.vertices - np.float32([0.1, 0.1, 0.0])
    vertices[:, 2] = rng.uniform(-0.004, 0.004, len(vertices))
    return TriMesh(vertices, grid.triangles)


def slab(rng):
    """A closed plate, 2 mm thick."""
    top = sheet(rng)
    count = len(top.vertices)
    below = top.vertices - np.float32([0.0, 0.0, 0.002])
    rim = np.flatnonzero(np.abs(top.vertices[:, :2]).max(axis=1) > 0.0999)
    rim = rim[np.argsort(np.arctan2(*top.vertices[rim, :2].T[::-1]))]
    after = np.roll(rim, -1)
    sides = np.concatenate([np.stack([rim, rim + count, after], 1), np.stack([after, rim + count, after + count], 1)])
    triangles = np.concatenate([top.triangles, top.triangles[:, ::-1] + count, sides])
    return TriMesh(np.concatenate([top.vertices, below]), triangles.astype(np.int32))


@pytest.mark.parametrize("kind", ["sheet", "slab"])
@pytest.mark.parametrize("who_moves", ["points", "collider", "both"])
def test_fast_points_do_not_pass_through(device, rng, kind, who_moves):
    """Neither do those that stand still while the collider moves by: they stay in front, at the distance."""
    mesh = sheet(rng) if kind == "sheet" else slab(rng)
    collider = {"is_double_sided": kind == "sheet"}
    colliders = Colliders(device)
    colliders.read([Collider("a", mesh, **collider)])
    count = 300
    last = rng.uniform(-0.07, 0.07, (count, 3)) * [1.0, 1.0, 0.0] + [0.0, 0.0, 0.02]
    below = rng.random(count) < 0.5
    last[below, 2] *= -1.0
    asked = Asked(colliders, count)
    asked(last)
    by = np.zeros(3)
    if who_moves != "points":
        by = np.array([0.001, -0.002, 0.05])
        below[:] = False
        last[:, 2] = np.abs(last[:, 2])
    points = last.copy()
    if who_moves != "collider":
        points += rng.uniform(-0.03, 0.03, (count, 3)) * [1.0, 1.0, 0.0]
        points[:, 2] = np.where(below, 1, -1) * rng.uniform(0.005, 0.04, count)
    colliders.read([Collider("a", TriMesh((mesh.vertices + by).astype(np.float32), mesh.triangles), **collider)])
    colliders.pose(1.0)
    planes = asked(points, last)
    assert is_plane(planes).all()
    np.testing.assert_array_equal(planes[:, 2] < 0.0, below)
    assert (gaps_of(planes, points) < -1e-3).all()
    np.testing.assert_allclose(planes[:, 4:7], np.tile(by, (count, 1)), atol=1e-6)


def test_a_double_sided_collider_keeps_the_side_of_a_point(device, rng):
    """Pressed slowly to the other side, it is asked back to its own, however long that takes; and it may go around."""
    colliders = Colliders(device)
    colliders.read([Collider("a", flat_grid(4, 0.1), distance=1e-3, is_double_sided=True)])
    points = np.concatenate([rng.uniform(0.01, 0.09, (32, 2)), np.repeat([[0.0005], [-0.0005]], 16, axis=0)], axis=1)
    side = np.sign(points[:, 2])
    asked = Asked(colliders, 32, points)
    for height in (0.0004, 0.0001, 0.0, -0.0003, -0.0008):
        last, points = points, np.concatenate([points[:, :2], (side * height)[:, None]], axis=1)
        planes = asked(points, last)
        np.testing.assert_allclose(planes[:, :3] * side[:, None], np.tile([0.0, 0.0, 1.0], (32, 1)), atol=1e-6)
        np.testing.assert_allclose(gaps_of(planes, points), height - 0.0005, atol=1e-7)
    angles = np.linspace(0.5 * np.pi, -0.5 * np.pi, 40)
    way = np.stack([0.1 + 0.0008 * np.cos(angles), np.full(40, 0.05), 0.0008 * np.sin(angles)], axis=1)
    way = np.concatenate([way[:1] - [0.01, 0, 0], way, way[-1:] - [0.01, 0, 0]])
    asked = Asked(colliders, 1, way[:1])
    for last, place in pairwise(way):
        planes = asked(place[None], last[None])
        assert gaps_of(planes, place[None])[0] > -0.00021


def test_beyond_the_rim_of_an_open_mesh_is_no_inside(device):
    colliders = Colliders(device)
    colliders.read([Collider("a", flat_grid(3, 0.1))])
    points = np.array([[-0.001, 0.05, -0.0005], [0.05, 0.101, -0.001], [-0.001, -0.001, -0.0001], [0.05, 0.05, -0.001]])
    planes = Asked(colliders, 4)(points)
    apart = distances(points, flat_grid(3, 0.1)) * [1, 1, 1, -1]
    np.testing.assert_allclose(gaps_of(planes, points), apart - 1e-3, atol=1e-7)


def groom_of(rng, mesh, count, segment):
    """Strands around a mesh, partly inside, with segments of a length."""
    roots = around(rng, mesh, count, 1e-4)
    steps = rng.normal(size=(count, 7, 3))
    steps *= segment / np.linalg.norm(steps, axis=2, keepdims=True)
    return np.concatenate([roots[:, None], roots[:, None] + np.cumsum(steps, axis=1)], axis=1).astype(np.float32)


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


def test_a_collider_that_appears_is_found_by_points_that_were_far_from_any(device):
    ball = subdivided_sphere(2, 0.1)
    colliders = Colliders(device)
    colliders.read([Collider("a", ball)])
    points = 1.004 * ball.vertices[:8].astype(np.float64) + [1.0, 0.0, 0.0]
    asked = Asked(colliders, 8)
    for _ in range(3):
        assert not asked(points).any()
    colliders.read([Collider("a", ball), Collider("b", TriMesh(ball.vertices + np.float32([1, 0, 0]), ball.triangles))])
    assert is_plane(asked(points)).all()
    colliders.read([Collider("a", ball)])
    assert not asked(points).any()


def test_points_near_the_surface_in_the_groom_keep_their_distance(device):
    colliders = Colliders(device)
    colliders.read([Collider("a", flat_grid(4, 0.1), distance=2e-3)])
    heights = np.array([0.0, 0.0005, 0.0019, 0.0021, 0.03])
    points = np.stack([0 * heights + 0.05, 0 * heights + 0.05, heights], axis=1)
    planes = Asked(colliders, 5, points)(points * [1, 1, 0])
    np.testing.assert_allclose(planes[:, 3], np.minimum(heights, 2e-3), atol=1e-7)


def test_a_segment_keeps_its_middle_outside(device):
    """Both ends take the plane of a ridge between them, and with it the middle comes to the distance; roots do not."""
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


def test_a_state_gives_the_same_planes(device, rng):
    mesh = bumpy(rng)
    colliders = Colliders(device)
    colliders.read([Collider("a", mesh, is_double_sided=True)])
    strands = groom_of(rng, mesh, 80, 0.004)
    contacts = Contacts(lanes_of(strands, device), colliders)
    for _ in range(5):
        last, strands = strands, strands + rng.normal(0, 0.001, strands.shape).astype(np.float32)
        contacts.find(lanes_of(strands, device), lanes_of(last, device), STEP)
    other = Contacts(lanes_of(strands + 1.0, device), colliders)
    other.load(contacts.state())
    planes = [c.find(lanes_of(strands, device), lanes_of(last, device), STEP).numpy() for c in (contacts, other)]
    np.testing.assert_array_equal(*planes)
    for wrong in ({}, {**contacts.state(), "vertex_rest": np.zeros((1, 2, 3), np.float32)}):
        with pytest.raises(HairError):
            other.load(wrong)


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
    for shape in ((2, 7, 8), (2, 3, 8)):
        with pytest.raises(HairError):
            Contacts(wp.zeros(shape, dtype=float, device=device), colliders)
    contacts = Contacts(wp.zeros((2, 9, 8), dtype=float, device=device), colliders)
    for shape in ((1, 9, 8), (2, 12, 8), (2, 9, 4)):
        with pytest.raises(HairError):
            contacts.find(wp.zeros(shape, dtype=float, device=device), contacts.planes, STEP)
